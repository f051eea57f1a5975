// Forwards the calls of one tap to several taps.
#pragma once

#include <algorithm>
#include <initializer_list>
#include <vector>

#include "core/tracking/tracker_tap.hpp"

namespace tricoil::host {

class TapFanOut final : public tracking::TrackerTap<double> {
public:
    /// Null pointers are ignored.
    TapFanOut(std::initializer_list<tracking::TrackerTap<double>*> taps) {
        std::copy_if(taps.begin(), taps.end(), std::back_inserter(taps_), [](const auto* tap) { return tap != nullptr; });
    }
    /// `tap` must outlive this object.
    void add(tracking::TrackerTap<double>& tap) { taps_.push_back(&tap); }
    [[nodiscard]] bool any() const { return !taps_.empty(); }

private:
    template <typename Call>
    void each(Call&& call) {
        for (auto* tap : taps_) {
            call(*tap);
        }
    }
    void do_begin(const Settings& settings) override {
        each([&](auto& tap) { tap.begin(settings); });
    }
    void do_column(const MeasuredColumn<double>& column) override {
        each([&](auto& tap) { tap.column(column); });
    }
    void do_tick(std::uint8_t sensor, DeviceTime now) override {
        each([&](auto& tap) { tap.tick(sensor, now); });
    }
    void do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) override {
        each([&](auto& tap) { tap.hemisphere(sensor, towards); });
    }
    void do_pose(const tracking::PoseEstimate<double>& estimate) override {
        each([&](auto& tap) { tap.pose(estimate); });
    }

    void do_fault(std::string_view text) override {
        each([&](auto& tap) { tap.fault(text); });
    }

    std::vector<tracking::TrackerTap<double>*> taps_;
};

}  // namespace tricoil::host

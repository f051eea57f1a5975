// Forwards the calls of one tap to several taps, in a simulation with the true poses.
#pragma once

#include <algorithm>
#include <functional>
#include <initializer_list>
#include <optional>
#include <vector>

#include "core/tracking/tracker_tap.hpp"

namespace tricoil::host {

class TapFanOut final : public tracking::TrackerTap<double> {
public:
    using TruthOf = std::function<std::optional<solver::RigidPose<double>>(std::uint8_t sensor, DeviceTime time)>;

    /// Null pointers are ignored.
    TapFanOut(std::initializer_list<tracking::TrackerTap<double>*> taps) {
        std::copy_if(taps.begin(), taps.end(), std::back_inserter(taps_), [](const auto* tap) { return tap != nullptr; });
    }
    /// `tap` must outlive this object.
    void add(tracking::TrackerTap<double>& tap) { taps_.push_back(&tap); }
    /// Passes the true pose of each pose, if `truth_of` has one.
    void set_truth(TruthOf truth_of) { truth_of_ = std::move(truth_of); }
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
    void do_truth(std::uint8_t sensor, DeviceTime time, const solver::RigidPose<double>& pose) override {
        each([&](auto& tap) { tap.truth(sensor, time, pose); });
    }
    void do_pose(const tracking::PoseEstimate<double>& estimate) override {
        if (const auto pose = truth_of_ ? truth_of_(estimate.sensor, estimate.time) : std::nullopt) {
            truth(estimate.sensor, estimate.time, *pose);
        }
        each([&](auto& tap) { tap.pose(estimate); });
    }

    void do_fault(std::string_view text) override {
        each([&](auto& tap) { tap.fault(text); });
    }

    std::vector<tracking::TrackerTap<double>*> taps_;
    TruthOf truth_of_;
};

}  // namespace tricoil::host

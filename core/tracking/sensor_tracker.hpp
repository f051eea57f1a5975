// One sensor's tracker, whichever kind was chosen: a solver without memory of motion, or the filter.
#pragma once

#include <optional>
#include <utility>
#include <variant>

#include "core/tracking/scaat/filter.hpp"
#include "core/tracking/tracker.hpp"

namespace tricoil::tracking {

/// Sensors that one source can serve: the bound of every table that is kept per sensor.
constexpr int kMaxSensors = 4;

template <typename Scalar>
class SensorTracker {
public:
    /// A solver, or the filter if its parameters are given; then only the coupling constant is taken of `params`. Made in place:
    /// a copy of a filter would be most of a small processor's stack.
    explicit SensorTracker(const TrackerParams<Scalar>& params, const std::optional<scaat::Params<Scalar>>& filter = std::nullopt)
        : tracker_(std::in_place_type<Tracker<Scalar>>, params) {
        if (filter) {
            tracker_.template emplace<scaat::Filter<Scalar>>(*filter,
                                                             scaat::ConcentricMeasurement<Scalar>{params.coupling_constant});
        }
    }

    std::optional<PoseEstimate<Scalar>> update(const Column<Scalar>& column) {
        return visit([&](auto& tracker) { return tracker.update(column); });
    }
    std::optional<PoseEstimate<Scalar>> tick(DeviceTime now) {
        return visit([&](auto& tracker) { return tracker.tick(now); });
    }
    Status set_hemisphere(const Vec3<Scalar>& towards) {
        return visit([&](auto& tracker) { return tracker.set_hemisphere(towards); });
    }
    [[nodiscard]] TrackerState state() const {
        return visit([](const auto& tracker) { return tracker.state(); });
    }
    [[nodiscard]] const TrackerCounters& counters() const {
        return visit([](const auto& tracker) -> const TrackerCounters& { return tracker.counters(); });
    }

private:
    using Either = std::variant<Tracker<Scalar>, scaat::Filter<Scalar>>;

    // Not std::visit: that may throw, and a firmware has nobody to catch.
    template <typename Action>
    decltype(auto) visit(Action&& action) {
        auto* filter = std::get_if<scaat::Filter<Scalar>>(&tracker_);
        return filter != nullptr ? action(*filter) : action(*std::get_if<Tracker<Scalar>>(&tracker_));
    }
    template <typename Action>
    decltype(auto) visit(Action&& action) const {
        const auto* filter = std::get_if<scaat::Filter<Scalar>>(&tracker_);
        return filter != nullptr ? action(*filter) : action(*std::get_if<Tracker<Scalar>>(&tracker_));
    }

    Either tracker_;
};
static_assert(sizeof(SensorTracker<float>) * kMaxSensors <= 10496, "trackers of all sensors, of 32 KiB RAM");

}  // namespace tricoil::tracking

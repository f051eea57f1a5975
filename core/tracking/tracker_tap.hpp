// Observer of all tracker inputs and outputs. A recording of them reproduces the same poses.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/interface.hpp"
#include "core/calibration/calibration.hpp"
#include "core/signal/column.hpp"
#include "core/solver/refine.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking {

/// Called in the order of the trackers' calls, from the loop that runs the trackers; an implementation must not wait for a slow
/// consumer. Scalar: the precision of the trackers.
template <typename Scalar>
class TrackerTap : public Interface {
public:
    /// Settings of the trackers of sensors 0 to sensors - 1.
    struct Settings {
        TrackerParams<Scalar> tracker;
        int sensors = 1;
        std::optional<calibration::Calibration<Scalar>> calibration = std::nullopt;  // applied to the columns by the trackers
    };

    /// The trackers have been created, or created again.
    void begin(const Settings& settings) { do_begin(settings); }
    /// Arguments of the tracker's update, tick and set_hemisphere.
    void column(const MeasuredColumn<Scalar>& column) { do_column(column); }
    void tick(std::uint8_t sensor, DeviceTime now) { do_tick(sensor, now); }
    void hemisphere(std::uint8_t sensor, const Vec3<Scalar>& towards) { do_hemisphere(sensor, towards); }
    /// True pose of a simulated sensor at this time, source frame; directly before the estimate of this time.
    void truth(std::uint8_t sensor, DeviceTime time, const solver::RigidPose<Scalar>& pose) { do_truth(sensor, time, pose); }
    /// An estimate that a tracker returned or a tracker board sent.
    void pose(const PoseEstimate<Scalar>& estimate) { do_pose(estimate); }
    /// One line about a refused input, or a problem of the device or its link.
    void fault(std::string_view text) { do_fault(text); }

private:
    // An observer overrides what it uses.
    virtual void do_begin(const Settings& /*settings*/) {}
    virtual void do_column(const MeasuredColumn<Scalar>& /*column*/) {}
    virtual void do_tick(std::uint8_t /*sensor*/, DeviceTime /*now*/) {}
    virtual void do_hemisphere(std::uint8_t /*sensor*/, const Vec3<Scalar>& /*towards*/) {}
    virtual void do_truth(std::uint8_t /*sensor*/, DeviceTime /*time*/, const solver::RigidPose<Scalar>& /*pose*/) {}
    virtual void do_pose(const PoseEstimate<Scalar>& /*estimate*/) {}
    virtual void do_fault(std::string_view /*text*/) {}
};

}  // namespace tricoil::tracking

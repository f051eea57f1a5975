// Sees all that the trackers of a board are given, and what they answer: whoever records it can have the same poses again.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "core/calibration/calibration.hpp"
#include "core/signal/column.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::hal {

/// Called in the order in which the trackers are, from the loop that runs them; nothing here may wait for a slow taker.
/// Scalar: the precision the trackers run in.
template <typename Scalar>
class TrackerTap {
public:
    /// How the trackers of sensor 0 to sensors - 1 are made.
    struct Settings {
        tracking::TrackerParams<Scalar> tracker;
        int sensors = 1;
        std::optional<calibration::Calibration<Scalar>> calibration = std::nullopt;  // that the trackers apply to the columns
    };

    TrackerTap() = default;
    TrackerTap(const TrackerTap&) = delete;
    TrackerTap& operator=(const TrackerTap&) = delete;
    virtual ~TrackerTap() = default;

    /// The trackers have been made, for the first time or anew.
    void begin(const Settings& settings) { do_begin(settings); }
    /// Handed to the tracker's update, tick and set_hemisphere.
    void column(const Column<Scalar>& column) { do_column(column); }
    void tick(std::uint8_t sensor, DeviceTime now) { do_tick(sensor, now); }
    void hemisphere(std::uint8_t sensor, const Vec3<Scalar>& towards) { do_hemisphere(sensor, towards); }
    /// What one of those answered, or a tracker board sent.
    void pose(const tracking::PoseEstimate<Scalar>& estimate) { do_pose(estimate); }
    /// One line about what was refused, or is wrong with the device or its link.
    void fault(std::string_view text) { do_fault(text); }

private:
    virtual void do_begin(const Settings& settings) = 0;
    virtual void do_column(const Column<Scalar>& column) = 0;
    virtual void do_tick(std::uint8_t sensor, DeviceTime now) = 0;
    virtual void do_hemisphere(std::uint8_t sensor, const Vec3<Scalar>& towards) = 0;
    virtual void do_pose(const tracking::PoseEstimate<Scalar>& estimate) = 0;
    virtual void do_fault(std::string_view /*text*/) {}
};

}  // namespace tricoil::hal

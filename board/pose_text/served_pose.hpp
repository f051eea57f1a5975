// Pose for clients, with its time in UTC and its expected error, and as one line of JSON.
#pragma once

#include <limits>
#include <optional>
#include <utility>

#include "board/pose_text/expected_error.hpp"
#include "board/pose_text/pose_fields.hpp"
#include "core/protocol/clock_map.hpp"

namespace tricoil::host {

struct ServedPose {
    tracking::PoseEstimate<double> pose;
    UtcTime utc;                                                         // pose time
    double expected_error_m = std::numeric_limits<double>::quiet_NaN();  // see ExpectedError
    std::optional<TruePose> truth = std::nullopt;                        // of a simulation, in the source frame
    std::optional<int> epoch = std::nullopt;                             // see PoseClock
};

/// The fields of all text forms, then utc_s (pose time, seconds since 1970), expected_error_mm and epoch, with line feed.
inline std::string served_pose_line(const ServedPose& served, const PoseUnits& units = {}) {
    return pose_line({.pose = served.pose, .utc = served.utc, .expected_error_m = served.expected_error_m, .epoch = served.epoch},
                     PoseFormat::json, kServedForm, units);
}

/// UTC of poses, from their device times and arrivals, and their epoch: how often the trackers or their device have started
/// again. Between epochs, times and sequence numbers increase, but the device did not measure how much time passed.
class PoseClock {
public:
    /// window_s: demodulation window. The shortest time from its midpoint to the arrival of its pose is half of it.
    void begin(double window_s) {
        map_ = {};
        epoch_ += std::exchange(has_poses_, false) ? 1 : 0;
        lead_ = microseconds_from_seconds(window_s / 2);
    }
    /// Of a pose that has just arrived.
    UtcTime utc(DeviceTime time) {
        has_poses_ = true;
        map_.observe(time, drivers::host_now());
        return to_utc(map_.to_host(time) - lead_);
    }

    [[nodiscard]] int epoch() const { return epoch_; }

private:
    protocol::ClockMap map_;
    int epoch_ = 0;
    bool has_poses_ = false;  // of this epoch
    Microseconds lead_{};
};

}  // namespace tricoil::host

// Pose for clients, with its time in UTC and its expected error, and as one line of JSON.
#pragma once

#include <limits>
#include <optional>

#include "board/pose_text/expected_error.hpp"
#include "board/pose_text/pose_fields.hpp"
#include "core/protocol/clock_map.hpp"

namespace tricoil::host {

struct ServedPose {
    tracking::PoseEstimate<double> pose;
    UtcTime utc;                                                         // pose time
    double expected_error_m = std::numeric_limits<double>::quiet_NaN();  // see ExpectedError
    std::optional<TruePose> truth = std::nullopt;                        // of a simulation, in the source frame
};

/// The fields of all text forms, then utc_s (pose time, seconds since 1970) and expected_error_mm, with line feed.
inline std::string served_pose_line(const ServedPose& served, const PoseUnits& units = {}) {
    return pose_line({.pose = served.pose, .utc = served.utc, .expected_error_m = served.expected_error_m}, PoseFormat::json,
                     kServedForm, units);
}

/// UTC of poses, from their device times and arrivals.
class PoseUtc {
public:
    /// window_s: demodulation window. The shortest time from its midpoint to the arrival of its pose is half of it.
    void begin(double window_s) {
        map_ = {};
        lead_ = microseconds_from_seconds(window_s / 2);
    }
    /// Of a pose that has just arrived.
    UtcTime at(DeviceTime time) {
        map_.observe(time, drivers::host_now());
        return to_utc(map_.to_host(time) - lead_);
    }

private:
    protocol::ClockMap map_;
    Microseconds lead_{};
};

}  // namespace tricoil::host

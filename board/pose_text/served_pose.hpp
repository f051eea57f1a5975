// Pose for clients, with its time in UTC, and as one line of JSON.
#pragma once

#include "board/pose_text/pose_fields.hpp"
#include "core/protocol/clock_map.hpp"

namespace tricoil::host {

struct ServedPose {
    tracking::PoseEstimate<double> pose;
    UtcTime utc;  // pose time
};

/// The fields of all text forms, then utc_s (pose time, seconds since 1970), with line feed.
inline std::string served_pose_line(const ServedPose& served, const PoseUnits& units = {}) {
    return pose_line({.pose = served.pose, .utc = served.utc}, PoseFormat::json, kServedForm, units);
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

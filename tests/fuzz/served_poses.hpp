// Poses for the fuzzers of outputs.
#pragma once

#include <vector>

#include "board/pose_text/served_pose.hpp"

namespace tricoil::fuzz {

/// Pose number n of a stream of two sensors at 240 Hz; some poses are invalid.
inline std::vector<host::ServedPose> served_poses(std::uint32_t n) {
    std::vector<host::ServedPose> poses(2);
    for (std::uint8_t sensor = 0; sensor < 2; ++sensor) {
        host::ServedPose& served = poses[sensor];
        served.utc = host::utc_time_us(1'700'000'000'000'000 + std::int64_t{4167} * n);
        served.pose.sensor = sensor;
        served.pose.sequence = n;
        served.pose.state = tracking::TrackerState::tracking;
        served.pose.position_m = {0.3 + 0.001 * (n % 100), -0.1, 0.05 * sensor};
        served.pose.flags.set_if(n % 7 == 3, tracking::PoseFlag::low_signal);
        served.pose.flags.set_if(n % 11 == 5, tracking::PoseFlag::hemisphere_unknown);
    }
    return poses;
}

}  // namespace tricoil::fuzz

// When the tracker falls silent, its last poses must not pass for fresh ones.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "board/pose_text/served_pose.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

class SilenceWatch {
public:
    static constexpr std::int64_t kLimitUs = 500'000;

    /// Looks at what came at now_us (UTC); appends, once, the last pose of each sensor of which nothing came for kLimitUs,
    /// flagged stale.
    void look(std::int64_t now_us, std::vector<ServedPose>& poses) {
        for (const ServedPose& served : poses) {
            if (served.pose.sensor < sensors_.size()) {
                sensors_[served.pose.sensor] = {served, now_us};
            }
        }
        for (auto& sensor : sensors_) {
            if (sensor.newest && now_us - sensor.came_us > kLimitUs) {
                sensor.newest->pose.flags.set(tracking::PoseFlag::stale);
                poses.push_back(*sensor.newest);
                sensor.newest.reset();
            }
        }
    }

private:
    struct Sensor {
        std::optional<ServedPose> newest;  // none: nothing yet, or its silence is told
        std::int64_t came_us = 0;
    };
    std::array<Sensor, tracking::kMaxSensors> sensors_;
};

}  // namespace tricoil::host

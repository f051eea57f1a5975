// Flags the last poses as stale when the tracker is silent.
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

    /// poses: new poses at now_us (UTC). Appends, once, the last pose of each sensor without a pose for kLimitUs, flagged stale.
    void check(std::int64_t now_us, std::vector<ServedPose>& poses) {
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
        std::optional<ServedPose> newest;  // none: no pose yet, or the silence was reported
        std::int64_t came_us = 0;
    };
    std::array<Sensor, tracking::kMaxSensors> sensors_;
};

}  // namespace tricoil::host

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
    static constexpr Microseconds kLimit{500'000};

    /// poses: new poses at `now`. If a sensor has had no pose for kLimit, appends its last pose once, flagged stale.
    void check(UtcTime now, std::vector<ServedPose>& poses) {
        for (const ServedPose& served : poses) {
            if (served.pose.sensor < sensors_.size()) {
                sensors_[served.pose.sensor] = {served, now};
            }
        }
        for (auto& sensor : sensors_) {
            if (sensor.newest && now - sensor.came > kLimit) {
                sensor.newest->pose.flags.set(tracking::PoseFlag::stale);
                poses.push_back(*sensor.newest);
                sensor.newest.reset();
            }
        }
    }

private:
    struct Sensor {
        std::optional<ServedPose> newest;  // none: no pose yet, or the silence was reported
        UtcTime came;
    };
    std::array<Sensor, tracking::kMaxSensors> sensors_;
};

}  // namespace tricoil::host

// Pose for clients, with its time in UTC.
#pragma once

#include "board/support/wall_clock.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::host {

struct ServedPose {
    tracking::PoseEstimate<double> pose;
    UtcTime utc;  // pose time
};

}  // namespace tricoil::host

// A pose on its way to clients: what the tracker said, and when that was by the clock on the wall.
#pragma once

#include <cstdint>

#include "core/tracking/pose_estimate.hpp"

namespace tricoil::host {

struct ServedPose {
    tracking::PoseEstimate<double> pose;
    std::int64_t utc_us = 0;  // of the pose's own time, since 1970
};

}  // namespace tricoil::host

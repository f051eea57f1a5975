// Pose for clients, with its time in UTC.
#pragma once

#include <cstdint>

#include "core/tracking/pose_estimate.hpp"

namespace tricoil::host {

struct ServedPose {
    tracking::PoseEstimate<double> pose;
    std::int64_t utc_us = 0;  // pose time, microseconds since 1970
};

}  // namespace tricoil::host

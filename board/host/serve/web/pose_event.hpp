// Pose events for the live page.
#pragma once

#include <span>
#include <string>

#include "board/pose_text/served_pose.hpp"
#include "board/support/link_health.hpp"

namespace tricoil::host::web {

struct PageStatus {
    bool running = true;
    bool recording = false;
    std::string recording_error;  // failure of the last recording; empty: none
    std::string controls;         // access rule: "token", "open" or "none"
    LinkHealth health;
};

/// One server-sent event: {"status": {...}, "poses": [...]}, with the newest pose of each sensor. Poses whose position or
/// covariance is not finite are left out.
std::string pose_event(std::span<const ServedPose> poses, const PageStatus& status);

}  // namespace tricoil::host::web

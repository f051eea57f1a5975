// Poses as the page wants them.
#pragma once

#include <span>
#include <string>

#include "board/pose_text/served_pose.hpp"

namespace tricoil::host::web {

struct PageStatus {
    bool running = true;
    bool recording = false;
    std::string trouble;   // of the last recording
    std::string controls;  // who may control: "token", "open" or "none"
};

/// One server-sent event: {"status": {...}, "poses": [...]}; of each sensor the newest pose only.
std::string pose_event(std::span<const ServedPose> poses, const PageStatus& status);

}  // namespace tricoil::host::web

// A served pose as one line of JSON.
#pragma once

#include "board/pose_text/pose_fields.hpp"
#include "board/pose_text/served_pose.hpp"

namespace tricoil::host {

/// The fields of all text forms, then utc_s (pose time, seconds since 1970), with line feed.
inline std::string served_pose_line(const ServedPose& served, const PoseUnits& units = {}) {
    return pose_line({.pose = served.pose, .utc = served.utc}, PoseFormat::json, kServedForm, units);
}

}  // namespace tricoil::host

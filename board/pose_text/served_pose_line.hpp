// A served pose as one line of JSON.
#pragma once

#include <string>

#include "board/pose_text/served_pose.hpp"

namespace tricoil::host {

/// The fields of all text forms (pose_fields), then utc_s (pose time, seconds since 1970), with line feed.
std::string served_pose_line(const ServedPose& served);

}  // namespace tricoil::host

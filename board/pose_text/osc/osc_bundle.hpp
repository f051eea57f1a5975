// Poses as Open Sound Control (OSC 1.0) bundles.
#pragma once

#include <string>

#include "board/pose_text/served_pose.hpp"

namespace tricoil::host {

/// Bundle for immediate use, with these messages; N is the number of the sensor, from 1:
/// - /tricoil/N/valid: int, 1 or 0
/// - /tricoil/N/position: three floats, x y z in m
/// - /tricoil/N/quaternion: four floats, w x y z
/// An invalid pose has the first message only.
std::string osc_bundle(const ServedPose& served);

}  // namespace tricoil::host

// Flags and states in words.
#pragma once

#include <string>

#include "core/tracking/pose_estimate.hpp"

namespace tricoil::host {

/// "low_signal, distorted"; empty for none.
std::string to_text(tracking::PoseFlags flags);
const char* to_text(tracking::TrackerState state);

}  // namespace tricoil::host

// Flags and states in words.
#pragma once

#include <string>

#include "core/tracking/pose_estimate.hpp"

namespace tricoil::host {

/// "low_signal, distorted"; empty for none.
std::string to_text(tracking::PoseFlags flags);
const char* to_text(tracking::TrackerState state);

/// What the user can do about flags that do not go by themselves; empty if there are none.
std::string advice(tracking::PoseFlags flags);

}  // namespace tricoil::host

// Names of pose flags and tracker states.
#pragma once

#include <span>
#include <string>

#include "core/tracking/pose_estimate.hpp"

namespace tricoil::host {

/// Names of all flags, in the order of their bits.
std::span<const char* const> flag_names();

/// For messages: for example "low_signal, distorted"; empty if no flag is set.
std::string to_text(tracking::PoseFlags flags);
const char* to_text(tracking::TrackerState state);

/// Instruction to the user for flags that do not clear by themselves; empty if there are none.
std::string advice(tracking::PoseFlags flags);

/// The flags of all poses, and what to do if none is valid.
std::string advice_without_poses(tracking::PoseFlags flags);

}  // namespace tricoil::host

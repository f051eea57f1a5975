// Recorded trajectories: files of 4x4 homogeneous matrices, four lines each, a blank line between.
#pragma once

#include <string>
#include <vector>

#include "sim/motion/motion.hpp"

namespace tricoil::host {

/// The poses of a file, in order. Throws InputError, naming file and line, for lines that do not hold four finite numbers,
/// matrices that are no rotation (off orthonormal by more than 0.02) or whose last line is not 0 0 0 1, and fewer than eight
/// poses.
std::vector<sim::Pose> read_trajectory(const std::string& path);

}  // namespace tricoil::host

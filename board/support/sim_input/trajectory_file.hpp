// Reads recorded trajectories: 4x4 homogeneous matrices, four lines each.
#pragma once

#include <string>
#include <vector>

#include "sim/motion/motion.hpp"

namespace tricoil::host {

/// Poses of a file, in order. Throws InputError, naming file and line, for lines without four finite numbers, matrices that
/// deviate from a rotation by more than 0.02 or whose last line is not 0 0 0 1, and fewer than eight poses.
std::vector<sim::Pose> read_trajectory(const std::string& path);

}  // namespace tricoil::host

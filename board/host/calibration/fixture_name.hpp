// What a fixture's name says: "ZinXdown" has z pointing in and x pointing down.
#pragma once

#include <optional>
#include <string>

#include "core/geometry/types.hpp"

namespace tricoil::host {

/// Directions in the stage's frame: right +x, left -x, out +y, in -y, up +z, down -z. Two axes are named, the third follows.
/// Returns the rotation that takes the mounted frame's components to the stage's (v_stage = R v_mounted); empty if the name is
/// none, or names no two different axes in different directions.
std::optional<Mat3<double>> rotation_of_fixture(const std::string& name);

/// The 24 rotations that take axes to axes: the one nearest to r (largest trace of the relative rotation).
Mat3<double> nearest_axis_rotation(const Mat3<double>& r);

}  // namespace tricoil::host

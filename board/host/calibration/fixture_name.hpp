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

}  // namespace tricoil::host

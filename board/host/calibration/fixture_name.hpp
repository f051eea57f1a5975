// Orientation from a fixture name: "ZinXdown" has z pointing in and x pointing down.
#pragma once

#include <optional>
#include <string>

#include "core/linear/matrix.hpp"

namespace tricoil::host {

/// Directions in the stage frame: right +x, left -x, out +y, in -y, up +z, down -z. The name gives two axes; the third follows.
/// Returns the rotation from the mounted frame to the stage frame (v_stage = R v_mounted); empty if the name does not give two
/// different axes in orthogonal directions.
std::optional<Mat3<double>> rotation_of_fixture(const std::string& name);

}  // namespace tricoil::host

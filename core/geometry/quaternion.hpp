// Unit quaternions for attitudes. Includes Eigen's cross products, inverses and determinants of 3x3 matrices.
#pragma once

#include <Eigen/Geometry>

#include "core/geometry/types.hpp"

namespace tricoil {

template <typename Scalar>
using Quat = Eigen::Quaternion<Scalar>;

}  // namespace tricoil

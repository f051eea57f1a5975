// Fixed-size vectors and matrices.
#pragma once

#include <Eigen/Core>

namespace tricoil {

template <typename Scalar>
using Vec3 = Eigen::Matrix<Scalar, 3, 1>;
template <typename Scalar>
using Mat3 = Eigen::Matrix<Scalar, 3, 3>;
template <typename Scalar>
using Vec6 = Eigen::Matrix<Scalar, 6, 1>;
template <typename Scalar>
using Mat6 = Eigen::Matrix<Scalar, 6, 6>;

}  // namespace tricoil

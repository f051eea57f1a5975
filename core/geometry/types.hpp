// Fixed-size linear algebra in the two scalar types that the core is built for.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace tricoil {

template <typename Scalar>
using Vec3 = Eigen::Matrix<Scalar, 3, 1>;
template <typename Scalar>
using Mat3 = Eigen::Matrix<Scalar, 3, 3>;
template <typename Scalar>
using Vec6 = Eigen::Matrix<Scalar, 6, 1>;
template <typename Scalar>
using Mat6 = Eigen::Matrix<Scalar, 6, 6>;
template <typename Scalar>
using Quat = Eigen::Quaternion<Scalar>;

}  // namespace tricoil

// Rotation nearest to a matrix.
#pragma once

#include <Eigen/SVD>

#include "core/geometry/types.hpp"

namespace tricoil::host {

/// Nearest in the Frobenius norm (Schoenemann 1966; sign as in Kabsch 1978). Any finite 3 x 3 matrix.
inline Mat3<double> nearest_rotation(const Mat3<double>& m) {
    const Eigen::JacobiSVD<Mat3<double>> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Mat3<double>& u = svd.matrixU();
    const Mat3<double>& v = svd.matrixV();
    const double sign = (u * v.transpose()).determinant() < 0 ? -1 : 1;
    return u * Vec3<double>(1, 1, sign).asDiagonal() * v.transpose();
}

}  // namespace tricoil::host

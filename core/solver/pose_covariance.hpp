// Closed-form covariance of the direct solution: the Cramer-Rao bound for equal noise on the nine entries.
#pragma once

#include "core/geometry/rotations.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::solver {

/// Covariance of (position in m, small rotation in rad), both in the source frame, for noise `sigma` per entry at coupling
/// strength k. From (14): with n = sigma / k the information times n^2 is 13.5 for relative range, 1/2 for roll about the line of
/// sight, and the block [[4.5, -2.25], [-2.25, 1.25]] for each transverse angle with its rotation. Written with u, it needs no
/// tracking frame.
template <typename Scalar>
Mat6<Scalar> pose_covariance(Scalar strength, Scalar range_m, const Vec3<Scalar>& u, Scalar sigma) {
    constexpr Scalar determinant = Scalar(4.5 * 1.25 - 2.25 * 2.25);
    const Scalar n_squared = (sigma / strength) * (sigma / strength);
    const Mat3<Scalar> along = u * u.transpose();
    const Mat3<Scalar> across = Mat3<Scalar>::Identity() - along;
    Mat6<Scalar> covariance;
    covariance.template topLeftCorner<3, 3>() =
        (n_squared * range_m * range_m) * (along / Scalar(13.5) + across * (Scalar(1.25) / determinant));
    covariance.template bottomRightCorner<3, 3>() = n_squared * (2 * along + across * (Scalar(4.5) / determinant));
    covariance.template topRightCorner<3, 3>() = (-n_squared * range_m * Scalar(2.25) / determinant) * geometry::skew(u);
    covariance.template bottomLeftCorner<3, 3>() = covariance.template topRightCorner<3, 3>().transpose();
    return covariance;
}

}  // namespace tricoil::solver

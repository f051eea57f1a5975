// Covariance of a pose due to the calibration's own errors.
#pragma once

#include "core/calibration/calibration.hpp"
#include "core/solver/pose_covariance.hpp"

namespace tricoil::tracking {

/// In the coordinate frame of the coils. A relative error e of C = k rho^3 changes the range by e / 3.
template <typename Scalar>
Mat6<Scalar> covariance_of_coil_errors(const calibration::CoilErrors<Scalar>& errors, const Vec3<Scalar>& position_m) {
    const Scalar range_m = position_m.norm();
    Mat6<Scalar> covariance = solver::pose_covariance<Scalar>(Scalar(1), range_m, position_m / range_m, errors.couplings);
    const Vec3<Scalar> of_constant_m = errors.coupling_constant / 3 * position_m;
    covariance.template topLeftCorner<3, 3>() += of_constant_m * of_constant_m.transpose();
    return covariance;
}

}  // namespace tricoil::tracking

// One previous-measurement step in closed form, without a signal matrix: result of (15)-(18) for any previous estimate.
#pragma once

#include "core/base/status.hpp"
#include "core/linear/matrix.hpp"
#include "core/solver/previous_measurement.hpp"

namespace tricoil::error_model {

/// Real pose relative to the tracking frame of an estimate. The increments depend only on it.
template <typename Scalar>
struct RelativePose {
    Vec3<Scalar> direction;  // P^ u: real line of sight; (1, 0, 0) if the estimate is correct
    Mat3<Scalar> rotation;   // P^ O^^T O P^^T: real attitude relative to the estimated one; I if the estimate is correct
};

/// Relative pose of the estimate `previous` and the real pose `real`, both in angles.
template <typename Scalar>
RelativePose<Scalar> relative_pose(const solver::AnglePose<Scalar>& real, const solver::AnglePose<Scalar>& previous);

/// Increments (15), (16) in closed form. W = k Q D(u) with u and Q of the relative pose, so 2 W_ij / k = 3 (Q u)_i u_j - Q_ij and
/// kappa = 2 W11 / k. Errors: not_converged if kappa <= 0, as in the solver.
template <typename Scalar>
Result<solver::TrackingIncrements<Scalar>> exact_increments(const RelativePose<Scalar>& relative, Scalar range_m);

/// Errors of one step, true minus measured. Angles are differences of the given continuous angles, not wrapped.
template <typename Scalar>
struct PoseAngleError {
    geometry::Spherical<Scalar> position;
    geometry::Euler<Scalar> attitude;
};

/// Errors after one step of the angle form. The increments are measured relative to `linearised_about`; (17), (18) are evaluated
/// at `estimate` and added to it. Closed loop: both are the previous estimate. Open loop: linearised about the real previous
/// pose, but the paper divides by the cosines of the measured elevations. Errors: not_converged (kappa <= 0, or exactly at a
/// pole).
template <typename Scalar>
Result<PoseAngleError<Scalar>> exact_step_error(const solver::AnglePose<Scalar>& real,
                                                const solver::AnglePose<Scalar>& linearised_about,
                                                const solver::AnglePose<Scalar>& estimate);

}  // namespace tricoil::error_model

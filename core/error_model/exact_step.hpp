// One previous-measurement step in closed form, without a signal matrix: what (15)-(18) give for any previous estimate.
#pragma once

#include "core/base/status.hpp"
#include "core/geometry/types.hpp"
#include "core/solver/previous_measurement.hpp"

namespace tricoil::error_model {

/// The real pose seen from the tracking frame of an estimate: all that an increment depends on.
template <typename Scalar>
struct RelativePose {
    Vec3<Scalar> direction;  // P^ u: real line of sight; (1, 0, 0) if the estimate is right
    Mat3<Scalar> rotation;   // P^ O^^T O P^^T: real attitude against the estimated one; I if the estimate is right
};

/// Of the estimate `previous`, for the real pose `real`, both in angles.
template <typename Scalar>
RelativePose<Scalar> relative_pose(const solver::AnglePose<Scalar>& real, const solver::AnglePose<Scalar>& previous);

/// Increments (15), (16) in closed form: W = k Q D(u) with u and Q of the relative pose, so that W11 = k kappa / 2 and every
/// ratio is one of products of two components. Errors: not_converged when kappa <= 0, as in the solver.
template <typename Scalar>
Result<solver::TrackingIncrements<Scalar>> exact_increments(const RelativePose<Scalar>& relative, Scalar range_m);

/// Errors of one step, true minus measured. Angles as differences of the continuous angles given, not wrapped.
template <typename Scalar>
struct PoseAngleError {
    geometry::Spherical<Scalar> position;
    geometry::Euler<Scalar> attitude;
};

/// The errors after one step of the angle form: increments measured about `linearised_about`, (17), (18) evaluated and added at
/// `estimate`. Closed loop: both are the previous estimate. Open loop: linearised about the real previous pose; the paper divides
/// by the measured elevations all the same. Errors: not_converged (kappa <= 0, or exactly on a pole).
template <typename Scalar>
Result<PoseAngleError<Scalar>> exact_step_error(const solver::AnglePose<Scalar>& real,
                                                const solver::AnglePose<Scalar>& linearised_about,
                                                const solver::AnglePose<Scalar>& estimate);

extern template RelativePose<float> relative_pose(const solver::AnglePose<float>&, const solver::AnglePose<float>&);
extern template RelativePose<double> relative_pose(const solver::AnglePose<double>&, const solver::AnglePose<double>&);
extern template Result<solver::TrackingIncrements<float>> exact_increments(const RelativePose<float>&, float);
extern template Result<solver::TrackingIncrements<double>> exact_increments(const RelativePose<double>&, double);
extern template Result<PoseAngleError<float>> exact_step_error(const solver::AnglePose<float>&, const solver::AnglePose<float>&,
                                                               const solver::AnglePose<float>&);
extern template Result<PoseAngleError<double>> exact_step_error(const solver::AnglePose<double>&,
                                                                const solver::AnglePose<double>&,
                                                                const solver::AnglePose<double>&);

}  // namespace tricoil::error_model

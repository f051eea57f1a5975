// Pose estimate from the filter's state, its covariance and the signal health.
#pragma once

#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/scaat/estimator.hpp"
#include "core/tracking/scaat/health.hpp"

namespace tricoil::tracking::scaat {

/// Fills in the data of estimator and health. `state`: of the estimator, or a prediction of it. `flags`: of the columns.
template <typename Scalar, typename Model>
void report_state(PoseEstimate<Scalar>& estimate, const State<Scalar>& state, const Estimator<Scalar, Model>& estimator,
                  const Health<Scalar, Model>& health, PoseFlags flags) {
    estimate.time = state.time;
    estimate.position_m = state.position_m;
    estimate.q_source_sensor = state.q_source_sensor;
    estimate.covariance = estimator.reported(state);
    estimate.flags = flags | health.flags();
    estimate.flags.set_if(!estimator.history().confirmed() || health.start_variance() > 0, PoseFlag::unconfirmed);
    estimate.flags.set_if(!estimator.is_settled(), PoseFlag::not_converged);
    estimate.flags.set_if(estimator.is_inconsistent(), PoseFlag::inconsistent);
    estimate.distortion_chi_square = health.distortion_chi_square();
    estimate.snr_db = health.snr_db();
    estimate.signal_matrix = health.signal_matrix();
}

/// Error budget of a filter: blur, latency, and the filter's covariance in place of the noise.
template <typename Scalar>
error_model::ErrorBudget<Scalar> expected_error(const State<Scalar>& state, const Mat6<Scalar>& covariance,
                                                const CommonParams<Scalar>& params) {
    error_model::BoardTiming<Scalar> timing;
    timing.window_s = params.window_s;
    timing.latency_s = params.latency_s;
    const error_model::MotionState<Scalar> motion{state.position_m, state.q_source_sensor,   state.velocity_m_s,
                                                  state.rate_rad_s, state.acceleration_m_s2, state.angular_acceleration_rad_s2};
    return error_model::budget_of(error_model::timing_errors(motion, timing), covariance);
}

/// Adds the errors of the calibrated coils, and those that the misfit suggests, to the covariance; states the latter in metres.
/// Systematic: averaging does not reduce them.
template <typename Scalar, typename Model>
void cover_misfit(PoseEstimate<Scalar>& estimate, const Health<Scalar, Model>& health) {
    const Scalar variance = health.systematic_variance();
    if (!(variance > 0)) {
        return;
    }
    const Scalar range_m = estimate.position_m.norm();
    estimate.covariance +=
        solver::pose_covariance<Scalar>(health.strength(), range_m, estimate.position_m / range_m, std::sqrt(variance));
    estimate.distortion_m = likely_distortion(health.strength(), range_m, std::sqrt(health.misfit_variance()));
}

/// Adds the blur to the covariance in all directions. Blur is systematic: it stays from column to column, and averaging does not
/// reduce it.
template <typename Scalar>
void cover_blur(PoseEstimate<Scalar>& estimate) {
    const Scalar position_m = estimate.predicted_error->blur.position_m;
    const Scalar rotation_rad = estimate.predicted_error->blur.rotation_rad;
    estimate.covariance.diagonal().template head<3>() += Vec3<Scalar>::Constant(position_m * position_m / 3);
    estimate.covariance.diagonal().template tail<3>() += Vec3<Scalar>::Constant(rotation_rad * rotation_rad / 3);
}

}  // namespace tricoil::tracking::scaat

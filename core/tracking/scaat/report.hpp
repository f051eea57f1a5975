// The report: a pose estimate from the filter's state, its covariance and the health of its signals.
#pragma once

#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/scaat/estimator.hpp"
#include "core/tracking/scaat/health.hpp"

namespace tricoil::tracking::scaat {

/// Over the recorded motions squared errors are 0.9 to 1.0 of the filter's own covariance, and a second of motion is only some
/// twenty independent errors: the covariance that is reported is a little larger rather than a little smaller.
constexpr double kCovarianceMargin = 1.1;

/// Fills in what estimator and health know; `state` is the estimator's, or a prediction of it. `flags`: of the columns.
template <typename Scalar, typename Model>
void report_state(PoseEstimate<Scalar>& estimate, const State<Scalar>& state, const Estimator<Scalar, Model>& estimator,
                  const Health<Scalar, Model>& health, PoseFlags flags) {
    estimate.time = state.time;
    estimate.position_m = state.position_m;
    estimate.q_source_sensor = state.q_source_sensor;
    // A window of innovations larger than predicted: some assumption is wrong. The covariance says so before the flag does.
    estimate.covariance =
        state.covariance.template topLeftCorner<6, 6>() * (Scalar(kCovarianceMargin) * estimator.covariance_factor());
    estimate.flags = flags | health.flags();
    estimate.flags.set_if(!estimator.record().confirmed(), PoseFlag::unconfirmed);
    estimate.flags.set_if(!estimator.is_settled(), PoseFlag::not_converged);
    estimate.flags.set_if(estimator.is_inconsistent(), PoseFlag::inconsistent);
    estimate.distortion_chi_square = health.distortion_chi_square();
    estimate.snr_db = health.snr_db();
    estimate.signal_matrix = health.signal_matrix();
}

/// Of the error model's terms a filter keeps the window's blur, the latency, and its own covariance in place of the noise.
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

/// Blur is no noise: it stays the same from column to column and averaging does not reduce it, so its size goes into the
/// covariance as it is, whatever its direction.
template <typename Scalar>
void cover_blur(PoseEstimate<Scalar>& estimate) {
    const Scalar position_m = estimate.predicted_error->blur.position_m;
    const Scalar rotation_rad = estimate.predicted_error->blur.rotation_rad;
    estimate.covariance.diagonal().template head<3>().array() += position_m * position_m / 3;
    estimate.covariance.diagonal().template tail<3>().array() += rotation_rad * rotation_rad / 3;
}

}  // namespace tricoil::tracking::scaat

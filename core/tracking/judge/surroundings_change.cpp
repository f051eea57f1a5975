#include "core/tracking/judge/surroundings_change.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/linear/cholesky.hpp"

namespace tricoil::tracking {
namespace {

constexpr double kUnlearnt = 0.05 * 0.05;  // variance of the share in a room that is used, or after a step

}  // namespace

SurroundingsChange::SurroundingsChange(const CommonParams<double>& params, const calibration::Calibration<double>& coils)
    : params_(params),
      coils_(coils),
      phases_(calibration::CoilCorrection<double>::phases(coils)),
      columns_(params.max_column_span),
      motion_(params),
      covariance_(State::Constant(params.quadrature_lag_s * params.quadrature_lag_s).asDiagonal()) {
    x_.setConstant(std::nan(""));  // no rates before two matrices
    covariance_(0, 0) = kUnlearnt;
}

void SurroundingsChange::update(const Column<double>& column, std::optional<PoseEstimate<double>>& pose) {
    if (column.midpoint + params_.lost_after < time_) {  // the device clock has restarted
        columns_.clear();
        motion_.clear();
        time_ = column.midpoint;
        x_.setConstant(std::nan(""));
    }
    Column<double> corrected = column;
    phases_.correct_column(coil_index(column.state), corrected.in_phase, corrected.quadrature, corrected.sigma);
    (void)motion_.add(corrected);
    fresh_ = column.quadrature.isZero(0) ? 0 : fresh_ + 1;  // zeros are not measured
    const bool is_matrix = columns_.note(corrected) && fresh_ >= kSourceCoils;
    if (!pose || !pose->valid()) {
        return;
    }
    if (is_matrix && motion_.known()) {
        learn(field::induced_couplings<double>(coils_.model, coils_.surroundings_lag.dipoles, pose->position_m,
                                               pose->q_source_sensor.toRotationMatrix().transpose()));
    }
    cover(*pose);
}

void SurroundingsChange::cover(PoseEstimate<double>& pose) {
    constexpr double kGate = 3;  // standard deviations
    const Mat3<double> o = pose.q_source_sensor.toRotationMatrix().transpose();
    const auto jacobian = field::signal_model(coils_.model, pose.position_m, o).jacobian;
    const Cholesky<double, 6> normal(jacobian.transpose() * jacobian);
    if (!normal.ok()) {
        return;
    }
    const Mat3<double> induced = field::induced_couplings(coils_.model, coils_.model.surroundings, pose.position_m, o);
    const Vec6<double> correction = normal.solve<1>(jacobian.transpose() * induced.reshaped());
    const double squared = state_(0) * state_(0);
    const double variance = covariance_(0, 0) + coils_.surroundings_lag.deviation * coils_.surroundings_lag.deviation;
    // The covariance may contain the misfit of the same metal already, which cannot be told from its other parts: what is missing
    // is added, up to the larger of both.
    const Cholesky<double, 6> stated(pose.covariance);
    const double covered = stated.ok() ? 1 / correction.dot(stated.solve<1>(correction)) : 0;
    pose.covariance += std::max(squared + variance - covered, 0.0) * correction * correction.transpose();
    if (squared > kGate * kGate * variance) {
        pose.distortion_m = std::max(pose.distortion_m, std::sqrt(squared) * correction.head<3>().norm());
        pose.flags.set(PoseFlag::distorted);
    }
    pose.flags.set_if(!(deviation_m(pose) <= params_.max_deviation_m), PoseFlag::uncertain);
}

/// Kalman filter on the nine quadratures. expected: the calibrated ones at the pose.
void SurroundingsChange::learn(const Mat3<double>& expected) {
    constexpr double kDrift_per_s = 1e-4;  // growth of the variance: a change by 0.01 in one second
    constexpr double kMotionLeft = 0.4;    // share of the variance of motion that the rates do not explain
    constexpr double kStep = 20;           // mean square of the innovations: metal has moved
    constexpr double kLongest_s = 0.015;   // between two matrices, for the rates
    const SignalMatrix<double> matrix = columns_.matrix();
    const double elapsed_s = seconds_as<double>(matrix.newest - std::exchange(time_, matrix.newest));
    const Mat3<double> rate = (matrix.x - std::exchange(x_, matrix.x)) / elapsed_s;
    fresh_ = 0;
    if (!(elapsed_s > 0 && elapsed_s < kLongest_s) || !rate.allFinite()) {
        return;
    }
    const double noise = matrix.quadrature_variance + kMotionLeft * motion_.quadrature_variance(params_.quadrature_lag_s);
    covariance_(0, 0) += kDrift_per_s * elapsed_s;
    double squares = 0;
    for (int j = 0; j < kSourceCoils; ++j) {
        for (int i = 0; i < kSensorCoils; ++i) {
            State by_state = State::Zero();
            by_state(0) = expected(i, j);
            by_state.segment<3>(1 + 3 * j) = rate.row(i).transpose();
            const State gain = covariance_ * by_state;
            const double variance = by_state.dot(gain) + noise;
            const double innovation = columns_.latest(j).quadrature(i) - expected(i, j) - by_state.dot(state_);
            state_ += innovation / variance * gain;
            covariance_ -= gain * gain.transpose() / variance;
            squares += innovation * innovation / variance;
        }
    }
    covariance_(0, 0) = std::max(covariance_(0, 0), squares > kStep * 9 ? kUnlearnt : 0);
}

}  // namespace tricoil::tracking

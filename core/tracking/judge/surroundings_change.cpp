#include "core/tracking/judge/surroundings_change.hpp"

#include <algorithm>
#include <cmath>

#include "core/linear/cholesky.hpp"

namespace tricoil::tracking {

SurroundingsChange::SurroundingsChange(const CommonParams<double>& params, const calibration::Calibration<double>& coils)
    : params_(params),
      coils_(coils),
      phases_(calibration::CoilCorrection<double>::phases(coils)),
      columns_(params.max_column_span),
      motion_(params) {}

void SurroundingsChange::update(const Column<double>& column, std::optional<PoseEstimate<double>>& pose) {
    if (column.midpoint + params_.lost_after < time_) {  // the device clock has restarted
        columns_.clear();
        motion_.clear();
    }
    Column<double> corrected = column;
    phases_.correct_column(coil_index(column.state), corrected.in_phase, corrected.quadrature, corrected.sigma);
    (void)motion_.add(corrected);
    fresh_ = columns_.note(corrected) ? fresh_ + 1 : 0;
    if (pose && pose->valid()) {
        cover(*pose);
    }
}

void SurroundingsChange::cover(PoseEstimate<double>& pose) {
    constexpr double kGate = 2.5;  // standard deviations
    const Mat3<double> o = pose.q_source_sensor.toRotationMatrix().transpose();
    if (fresh_ >= kSourceCoils && motion_.known()) {
        learn(field::induced_couplings(coils_.model, coils_.surroundings_lag.dipoles, pose.position_m, o));
    }
    const double variance = variance_ + coils_.surroundings_lag.deviation * coils_.surroundings_lag.deviation;
    const auto jacobian = field::signal_model(coils_.model, pose.position_m, o).jacobian;
    const Cholesky<double, 6> normal(jacobian.transpose() * jacobian);
    if (!(change_ * change_ > kGate * kGate * variance) || !normal.ok()) {
        return;
    }
    const Mat3<double> induced = field::induced_couplings(coils_.model, coils_.model.surroundings, pose.position_m, o);
    const Vec6<double> correction = normal.solve<1>(jacobian.transpose() * induced.reshaped());
    pose.covariance += (change_ * change_ + variance) * correction * correction.transpose();
    pose.distortion_m = std::max(pose.distortion_m, std::abs(change_) * correction.head<3>().norm());
    pose.flags.set(PoseFlag::distorted);
    pose.flags.set_if(!(deviation_m(pose) <= params_.max_deviation_m), PoseFlag::uncertain);
}

/// Kalman filter of a random walk. expected: the calibrated quadratures at the pose.
void SurroundingsChange::learn(const Mat3<double>& expected) {
    constexpr double kDrift_per_s = 0.01;  // growth of the variance: a change by 0.1 in one second
    const SignalMatrix<double> matrix = columns_.matrix();
    Mat3<double> measured;
    for (int j = 0; j < kSourceCoils; ++j) {
        measured.col(j) = columns_.latest(j).quadrature;
    }
    const double size = expected.squaredNorm();
    const double noise = (matrix.quadrature_variance + motion_.quadrature_variance(params_.quadrature_lag_s)) / size;
    variance_ = std::min(variance_ + kDrift_per_s * std::clamp(seconds_as<double>(matrix.newest - time_), 0.0, 1.0), 1.0);
    const double gain = variance_ / (variance_ + noise);
    change_ += gain * (expected.cwiseProduct(measured).sum() / size - 1 - change_);
    variance_ *= 1 - gain;
    time_ = matrix.newest;
    fresh_ = 0;
}

}  // namespace tricoil::tracking

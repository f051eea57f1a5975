// Definitions of Estimator. Include only where it is instantiated.
#pragma once

#include <cmath>

#include "core/tracking/scaat/estimator.hpp"

namespace tricoil::tracking::scaat {

template <typename Scalar, MeasurementModel<Scalar> Model>
void Estimator<Scalar, Model>::start(const StartPose<Scalar>& pose, const std::optional<StartRates<Scalar>>& rates,
                                     const SignalMatrixAssembler<Scalar>& columns, Scalar unmodelled_variance) {
    start_state<Scalar>(state_, model_, pose, rates, columns, params_, unmodelled_variance);
    last_used_ = state_.time;
    history_.start(state_.time);
    reset_adaptation();
}

template <typename Scalar, MeasurementModel<Scalar> Model>
void Estimator<Scalar, Model>::reset_adaptation() {
    translation_ = {std::log(params_.process.start_m2_s3)};
    rotation_ = {std::log(params_.process.start_rad2_s3)};
    consistency_ = 1;
    outlier_inflation_ = 0;
    noise_.restart();
    settled_ = kSourceCoils;
}

template <typename Scalar, MeasurementModel<Scalar> Model>
bool Estimator<Scalar, Model>::use(const Column<Scalar>& column, const Motion<Scalar>& around, const Use& use) {
    const int coil = coil_index(column.state);
    auto innovation = column_innovation<Scalar>(model_, state_, around, column, use.unmodelled);
    const bool far = use.trust != Trust::near &&
                     innovation.y.squaredNorm() > params_.most_inflated * params_.most_inflated * column.in_phase.squaredNorm();
    const bool may_inflate = use.trust != Trust::none && !far && !history_.any_far();
    Vec3<Scalar> whitened = innovation.whitened();
    Scalar nis = whitened.squaredNorm();
    int inflations = 0;
    for (; may_inflate && innovation.ok && nis > params_.gate && inflations < kMaxInflations; ++inflations) {
        inflate_covariance(nis / 3);
        innovation = column_innovation<Scalar>(model_, state_, around, column, use.unmodelled);
        whitened = innovation.whitened();
        nis = whitened.squaredNorm();
    }
    if (!innovation.ok || !(nis <= params_.gate)) {
        history_.refuse(coil, far);
        ++counters_.outliers;
        return false;
    }
    history_.accept(coil, column.midpoint);
    if (inflations > 0 && !use.in_frame) {
        history_.inflate();
    }
    if (use.trust == Trust::none && innovation.late_s <= 0 && nis > Scalar(kDownweightAbove)) {
        const Scalar excess = nis / Scalar(kDownweightAbove);
        innovation.set_noise(excess * excess * excess * innovation.r);
    }
    update_state(column, innovation, whitened, use.in_frame);
    return true;
}

/// Updates the state, and the estimates that depend on the innovation.
template <typename Scalar, MeasurementModel<Scalar> Model>
void Estimator<Scalar, Model>::update_state(const Column<Scalar>& column, const Innovation<Scalar>& innovation,
                                            const Vec3<Scalar>& whitened, bool in_frame) {
    const Scalar nis = whitened.squaredNorm();
    if (innovation.late_s <= 0) {
        noise_.add(column);
    }
    outlier_inflation_ = std::max(nis / Scalar(kInflateAbove), Scalar(kInflationDecay) * outlier_inflation_);
    const bool settled = is_settled();
    if (settled) {
        adapt_process_noise(innovation, whitened, in_frame);
    }
    consistency_ += settled ? params_.consistency_gain * (nis / 3 - consistency_) : Scalar(0);
    const auto gains_per_s = acceleration_gains_per_s(state_.covariance);
    const Vec12<Scalar> correction = apply(state_, innovation);
    if (is_learning()) {
        learn_acceleration(state_, correction, gains_per_s);
    }
    last_used_ = std::max(last_used_, column.midpoint);
    settled_ = std::min(settled_ + 1, kLearningColumns);
}

/// Adapts the process noise with the original innovation, but with the reduced weight of the column. In a frame, the first column
/// correlates the errors of position and rotation. The shares of the two then add up to more than the share of the whole
/// prediction, the Fisher information is too large, and the steps of log q are too small: after a fast motion q stays high. Both
/// shares are therefore scaled to the share of the prediction. In TDM this has little effect and is left out.
template <typename Scalar, MeasurementModel<Scalar> Model>
void Estimator<Scalar, Model>::adapt_process_noise(const Innovation<Scalar>& innovation, const Vec3<Scalar>& whitened,
                                                   bool in_frame) {
    const auto adapt_block = [&](int block, Scalar unit_squared, DensityLimits<Scalar> limits, DensityEstimate<Scalar>& q,
                                 const Mat3<Scalar>& share) {
        const Scalar variance = state_.covariance.template block<3, 3>(block, block).trace();
        if (variance < Scalar(kFineEnough * kFineEnough) * unit_squared) {
            limits.least = std::max(limits.least, q.log_q);
        }
        adapt(q, limits, share, whitened, params_.process);
    };
    const Scalar range_squared = state_.position_m.squaredNorm();
    const auto share = [&](int block) -> Mat3<Scalar> {
        const Matrix<Scalar, 3, 3> h = innovation.h.template middleCols<3>(block);
        return innovation.share_of(h * state_.covariance.template block<3, 3>(block, block) * h.transpose());
    };
    Mat3<Scalar> translation = share(0);
    Mat3<Scalar> rotation = share(3);
    if (in_frame) {
        const Scalar whole = innovation.share_of(innovation.predicted).trace();
        const Scalar factor = std::min(Scalar(1), whole / (translation.trace() + rotation.trace()));
        translation *= factor;
        rotation *= factor;
    }
    adapt_block(0, range_squared, translation_limits_, translation_, translation);
    adapt_block(3, Scalar(1), rotation_limits_, rotation_, rotation);
}

/// Multiplies the covariance of the prediction, and the process noise.
template <typename Scalar, MeasurementModel<Scalar> Model>
void Estimator<Scalar, Model>::inflate_covariance(Scalar factor) {
    const Scalar log_factor = std::log(factor);
    state_.covariance *= factor;
    translation_.log_q = std::min(translation_.log_q + log_factor, translation_limits_.most);
    rotation_.log_q = std::min(rotation_.log_q + log_factor, rotation_limits_.most);
    ++counters_.covariance_inflations;
}

template <typename Scalar, MeasurementModel<Scalar> Model>
bool Estimator<Scalar, Model>::is_within_gate(const Vec3<Scalar>& position_m, const Mat3<Scalar>& covariance) const {
    const Vec3<Scalar> apart = state_.position_m - position_m;
    const Mat3<Scalar> expected = state_.covariance.template topLeftCorner<3, 3>() + covariance;
    const Cholesky<Scalar, 3> factors(expected);
    return factors.ok() && factors.solve_lower(apart).squaredNorm() <= params_.gate;
}

template <typename Scalar, MeasurementModel<Scalar> Model>
void Estimator<Scalar, Model>::propagate_to(DeviceTime time) {
    propagate(state_, intensity(), time);
}

}  // namespace tricoil::tracking::scaat

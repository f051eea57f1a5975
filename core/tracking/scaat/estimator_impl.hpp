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
    adaptation_.restart(params_.process);
    noise_.restart();
    settled_ = kSourceCoils;
    lag_ = {};
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
    if (use.trust == Trust::none && innovation.late_s <= 0) {
        reduce_weight(innovation, excess_of(nis));
    }
    update_state(column, innovation, whitened, use.in_frame);
    return true;
}

template <typename Scalar, MeasurementModel<Scalar> Model>
void Estimator<Scalar, Model>::update_state(const Column<Scalar>& column, const Innovation<Scalar>& innovation,
                                            const Vec3<Scalar>& whitened, bool in_frame) {
    if (innovation.late_s <= 0) {
        noise_.add(column);
    }
    adaptation_.add(params_, state_, innovation, whitened, in_frame, is_settled());
    const auto gains_per_s = acceleration_gains_per_s(state_.covariance);
    const auto variance = [this](int n) { return state_.covariance.template block<3, 3>(3 * n, 3 * n).trace(); };
    const std::array before{variance(0), variance(1)};
    const Vec12<Scalar> correction = apply(state_, innovation);
    for (int n = 0; n < 2; ++n) {
        lag_[n].add(correction.template segment<3>(3 * n), before[n], variance(n));
    }
    if (is_learning()) {
        learn_acceleration(state_, correction, gains_per_s);
    }
    last_used_ = std::max(last_used_, column.midpoint);
    settled_ = std::min(settled_ + 1, kLearningColumns);
}

template <typename Scalar, MeasurementModel<Scalar> Model>
void Estimator<Scalar, Model>::inflate_covariance(Scalar factor) {
    state_.covariance *= factor;
    adaptation_.inflate(factor);
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

// First state of the filter: a direct pose with large covariance, updated with its three columns at their own times.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <utility>

#include "core/tracking/front/signal_matrix_assembler.hpp"
#include "core/tracking/scaat/column_update.hpp"
#include "core/tracking/scaat/propagate.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking::scaat {

/// Measurement variances with a lower limit relative to the prediction's variance: one column may not reduce a variance by more
/// than the scalar type resolves (float: 10^5), or than 10^10: the next columns of the frame divide by what it leaves of
/// correlated variances. It matters only with noise far below 1 um, for the first columns after a start or an error of the
/// prediction.
template <typename Scalar>
Vec3<Scalar> resolvable_variance(const Vec3<Scalar>& variance, const Innovation<Scalar>& innovation) {
    constexpr Scalar kShare = std::max(64 * std::numeric_limits<Scalar>::epsilon(), Scalar(1e-10));
    return variance.cwiseMax(kShare * innovation.predicted.trace());
}

/// Coupling errors of a column other than noise.
template <typename Scalar>
struct Unmodelled {
    Scalar variance = 0;                           // coupling units squared
    Vec3<Scalar> residual = Vec3<Scalar>::Zero();  // known error, coupling units
};

/// Variance of the second-order terms that the linearisation omits. They are the square of the relative error of the predicted
/// column: a column falls with the third power of the range. With noise far below them, the covariance would otherwise be too
/// small while the sensor accelerates. squared: of the column.
template <typename Scalar>
Scalar second_order_variance(const Innovation<Scalar>& innovation, Scalar squared) {
    const Scalar predicted = innovation.predicted.trace();
    return predicted * predicted / std::max(squared, predicted);
}

/// Innovation of a column, with second_order_variance() and resolvable_variance(). `around` as in innovation(); a point other
/// than the state is a measured pose, for which second-order terms are small.
template <typename Scalar, MeasurementModel<Scalar> Model>
Innovation<Scalar> column_innovation(const Model& model, const State<Scalar>& state, const Motion<Scalar>& around,
                                     const Column<Scalar>& column, const Unmodelled<Scalar>& unmodelled) {
    const Scalar late_s = column.midpoint < state.time ? seconds_as<Scalar>(state.time - column.midpoint) : Scalar(0);
    const int j = coil_index(column.state);
    auto result = innovation<Scalar>(model, state, around, j, column.in_phase - unmodelled.residual, late_s);
    const bool at_state = &around == static_cast<const Motion<Scalar>*>(&state);
    const Scalar curved = at_state ? second_order_variance<Scalar>(result, column.in_phase.squaredNorm()) : Scalar(0);
    const Vec3<Scalar> variance = column.sigma.cwiseAbs2() + Vec3<Scalar>::Constant(unmodelled.variance + curved);
    result.set_noise(resolvable_variance<Scalar>(variance, result));
    return result;
}

/// Latest three columns of an assembler, oldest first. Three compare-and-swap steps need less flash than std::sort.
template <typename Scalar>
std::array<const Column<Scalar>*, kSourceCoils> oldest_first(const SignalMatrixAssembler<Scalar>& columns) {
    std::array<const Column<Scalar>*, kSourceCoils> order{&columns.latest(0), &columns.latest(1), &columns.latest(2)};
    for (const auto& [i, j] : {std::pair{0U, 1U}, {1U, 2U}, {0U, 1U}}) {
        if (order[j]->midpoint < order[i]->midpoint) {
            std::swap(order[i], order[j]);
        }
    }
    return order;
}

/// Rates at which a sensor starts.
template <typename Scalar>
struct StartRates {
    Vec3<Scalar> velocity_m_s = Vec3<Scalar>::Zero();
    Vec3<Scalar> rate_rad_s = Vec3<Scalar>::Zero();
};

/// Prior of a start at the time of the oldest column: the pose with a standard deviation that covers the motion between the
/// columns.
template <typename Scalar>
void set_prior(State<Scalar>& state, const StartRates<Scalar>& rates, Scalar span_s, const ScaatParams<Scalar>& params) {
    state.velocity_m_s = rates.velocity_m_s;
    state.rate_rad_s = rates.rate_rad_s;
    const Scalar speed = std::max(params.start_speed_m_s, rates.velocity_m_s.norm());
    const Scalar rate = std::max(params.start_rate_rad_s, rates.rate_rad_s.norm());
    Vec12<Scalar> deviation;
    deviation.template segment<3>(0).setConstant(Scalar(0.03) * state.position_m.norm() + span_s * speed);
    deviation.template segment<3>(3).setConstant(Scalar(0.1) + span_s * rate);
    deviation.template segment<3>(6).setConstant(params.start_speed_m_s);
    deviation.template segment<3>(9).setConstant(params.start_rate_rad_s);
    state.covariance = deviation.cwiseAbs2().asDiagonal();
}

/// Sets `state` to the time of the newest of the assembler's three columns. The prior is the direct pose of the three columns as
/// if simultaneous. The columns are then used a second time as updates; with the wide prior that adds less than 1 % of
/// information. Position and velocity errors become correlated, as they must: the next three columns determine the velocity,
/// which is the difference of two deskewed poses weighted by the noise. With `rates`, of a fast sensor, the updates are repeated
/// from the pose that they gave, because the direct pose of the skewed columns is too far for one linear step.
/// unmodelled_variance: of errors of the couplings other than noise (metal, or motion that the prior does not cover).
/// Works in place to save stack: a state takes a quarter of a small processor's stack.
template <typename Scalar, MeasurementModel<Scalar> Model>
[[gnu::noinline]] void start_state(State<Scalar>& state, const Model& model, const StartPose<Scalar>& start,
                                   const std::optional<StartRates<Scalar>>& rates, const SignalMatrixAssembler<Scalar>& columns,
                                   const ScaatParams<Scalar>& params, Scalar unmodelled_variance) {
    constexpr int kFastPasses = 6;
    const auto order = oldest_first(columns);
    state = State<Scalar>{};
    state.position_m = start.position_m;
    state.q_source_sensor = Quat<Scalar>(Mat3<Scalar>(start.attitude.transpose())).normalized();
    const Scalar span_s = seconds_as<Scalar>(order.back()->midpoint - order.front()->midpoint);
    const Intensity<Scalar> q{params.process.start_m2_s3, params.process.start_rad2_s3};
    for (int pass = 0; pass < (rates ? kFastPasses : 1); ++pass) {
        if (pass > 0) {
            move(state, -span_s);
        }
        state.time = order.front()->midpoint;
        set_prior(state, rates.value_or(StartRates<Scalar>{}), span_s, params);
        for (const auto* column : order) {
            propagate(state, q, column->midpoint);
            const auto innovation = column_innovation<Scalar>(model, state, state, *column, {unmodelled_variance});
            if (innovation.ok) {
                (void)apply(state, innovation);
            }
        }
    }
}

}  // namespace tricoil::tracking::scaat

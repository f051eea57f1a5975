#include <algorithm>
#include <cmath>

#include "core/base/precision.hpp"
#include "core/error_model/error_budget.hpp"
#include "core/selfcheck/checks.hpp"
#include "core/selfcheck/known_answer.hpp"
#include "core/selfcheck/short_example.hpp"

namespace tricoil::selfcheck {
namespace {

using error_model::Loop;

constexpr ShortExample kOne{5, 0, 0};
constexpr ShortExample kTwo{0, 0, 5};
constexpr ShortExample kThree{4, 0.75, 0};

double largest(const Worst& worst) { return std::max({worst.range_m, worst.azimuth_rad, worst.elevation_rad}); }

template <typename Scalar>
double prediction_error(const ShortExample& example, Loop loop) {
    const auto result = run_example<Scalar>(example, loop);
    return result.ok ? largest(result.prediction) : kInfinite;
}

/// The azimuth of example III is not checked: it jumps at the pole, and so do rounding errors.
template <typename Scalar>
double prediction_error_three() {
    const auto result = run_example<Scalar>(kThree, Loop::open);
    return result.ok ? std::max(result.prediction.range_m, result.prediction.elevation_rad) : kInfinite;
}

/// Time between the predicted and the measured passage of the pole, in updates.
template <typename Scalar>
double singular_instants() {
    const auto result = run_example<Scalar>(kThree, Loop::open);
    if (!result.ok || !result.predicted_passage || !result.measured_passage) {
        return kInfinite;
    }
    return std::abs(to_seconds(*result.predicted_passage - *result.measured_passage)) / kExampleUpdate;
}

template <typename Scalar>
double budget_error() {
    error_model::MotionState<Scalar> state;
    state.position_m << Scalar(0.5), Scalar(0.3), Scalar(-0.2);
    state.q_source_sensor =
        geometry::attitude_quaternion(geometry::attitude_matrix(geometry::Euler<Scalar>{Scalar(0.4), Scalar(-0.6), Scalar(1.1)}));
    state.velocity_m_s << Scalar(0.7), Scalar(-0.4), Scalar(0.9);
    state.angular_rate_rad_s << Scalar(1.5), Scalar(-0.8), Scalar(2);
    state.acceleration_m_s2 << Scalar(3), Scalar(-2), Scalar(5);
    error_model::BudgetParams<Scalar> params;
    params.timing = error_model::tdm_timing(Scalar(1.0 / 720), Scalar(2e-3));
    const auto errors = error_model::systematic_errors(state, params);
    const auto skew = known<6, 1>(0.00019214245408843826, -0.00058963655483738713, -0.00026581896993946476, 0.0025688192520775623,
                                  0.0048190308556478895, 0.0058901777469990728);
    const auto blur = known<6, 1>(-1.1784983196940736e-06, -1.9125103902155736e-07, -2.5913283381825286e-07,
                                  -1.6313642633766908e-06, -1.6662396153517218e-06, 1.2386772884052677e-06);
    return std::max(worst_difference(errors.skew, skew) / 6e-3, worst_difference(errors.blur, blur) / 2e-6);
}

}  // namespace

template <typename Scalar>
void check_examples(Report& report) {
    constexpr Precision p = precision_of<Scalar>();
    // Rounding errors accumulate over the updates, most where the elevation reaches 15 rad. Limits: eight times the x86-64
    // values.
    report.add(CheckId::example_one, p, "example I: prediction (m, rad)", prediction_error<Scalar>(kOne, Loop::open),
               roundings<Scalar>(8 * 8));
    report.add(CheckId::example_two, p, "example II: prediction (m, rad)", prediction_error<Scalar>(kTwo, Loop::open),
               roundings<Scalar>(8 * 120));
    report.add(CheckId::example_three, p, "example III: prediction (m, rad)", prediction_error_three<Scalar>(),
               roundings<Scalar>(8 * 8));
    // Known errors of closed loops. The check is two-sided: a smaller error also fails. The limit of example II allows for
    // rounding errors of angles of 15 rad.
    const auto off = [](double error, double known_error) { return std::abs(error - known_error); };
    report.add(CheckId::closed_loop_one, p, "example I, closed: e - 0.001813 rad",
               off(run_example<Scalar>(kOne, Loop::closed).error.azimuth_rad, 0.0018125083), roundings<Scalar>(8) + 3e-10);
    report.add(CheckId::closed_loop_two, p, "example II, closed: e - 0.001904 rad",
               off(run_example<Scalar>(kTwo, Loop::closed).error.elevation_rad, 0.0019037032), roundings<Scalar>(16) + 3e-10);
    report.add(CheckId::singular_instants, p, "singular instant (updates)", singular_instants<Scalar>(), 1);
}

template <typename Scalar>
void check_error_model(Report& report) {
    constexpr Precision p = precision_of<Scalar>();
    const auto off = [](double error, double known_error) { return std::abs(error - known_error); };
    check_examples<Scalar>(report);
    // Error at the end of the short example, at 0.65 m. The example of the paper ends after 10 s at 3.5 m with 18.2 mm.
    report.add(CheckId::pole_free, p, "example III, pole-free: e - 2.901 mm",
               off(pole_free_error<Scalar>(kThree, 1), 0.0029011904), roundings<Scalar>(8) + 3e-10);
    report.add(CheckId::pole_free, p, "example III, two passes: e - 88 nm",
               off(pole_free_error<Scalar>(kThree, 2), 8.7567436e-08), roundings<Scalar>(8) + 2e-14);
    report.add(CheckId::error_budget, p, "error budget (relative)", budget_error<Scalar>(), roundings<Scalar>(128) + 1.3e-8);
}

template void check_examples<float>(Report&);
template void check_error_model<float>(Report&);
#if TRICOIL_SCALARS & 2  // double
template void check_examples<double>(Report&);
template void check_error_model<double>(Report&);
#endif

}  // namespace tricoil::selfcheck

#include "core/error_model/error_budget.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/precision.hpp"
#include "core/error_model/step_error.hpp"
#include "core/solver/pose_covariance.hpp"

namespace tricoil::error_model {
namespace {

template <typename Scalar>
ErrorTerm<Scalar> term(const PoseError<Scalar>& error) {
    return {error.template head<3>().norm(), error.template tail<3>().norm()};
}

/// Linearization and frame propagation errors. A further pass on the same matrix starts from the error of the previous pass,
/// which takes the place of the motion.
template <typename Scalar>
void add_step_errors(MotionState<Scalar> state, const BudgetParams<Scalar>& params, SystematicErrors<Scalar>& errors) {
    const bool angles = params.solver == SolverForm::previous_angles;
    Scalar duration_s = params.timing.update_s;
    for (int pass = 0; pass < params.passes; ++pass) {
        errors.linearization = linearization_error(state, duration_s, angles ? StepForm::angles : StepForm::vectors);
        if (angles) {
            errors.frame_propagation = frame_propagation_error(state, duration_s);
        }
        const PoseError<Scalar> left = errors.linearization + errors.frame_propagation;
        state.velocity_m_s = left.template head<3>();
        state.angular_rate_rad_s = left.template tail<3>();
        duration_s = 1;
    }
}

}  // namespace

template <typename Scalar>
SystematicErrors<Scalar> timing_errors(const MotionState<Scalar>& state, const BoardTiming<Scalar>& timing) {
    SystematicErrors<Scalar> errors;
    if (!timing.column_age_s.isZero(0)) {
        errors.skew = skew_error(state, timing.column_age_s);
    }
    if (timing.window_s > 0) {
        errors.blur = blur_error(state, timing.window_s);
    }
    errors.latency = latency_error(state, timing.latency_s);
    return errors;
}

template <typename Scalar>
SystematicErrors<Scalar> systematic_errors(const MotionState<Scalar>& state, const BudgetParams<Scalar>& params) {
    SystematicErrors<Scalar> errors = timing_errors(state, params.timing);
    if (params.solver != SolverForm::direct) {
        add_step_errors(state, params, errors);
    }
    return errors;
}

template <typename Scalar>
ErrorBudget<Scalar> error_budget(const MotionState<Scalar>& state, Scalar noise_ratio, const BudgetParams<Scalar>& params) {
    const Scalar range = state.position_m.norm();
    return budget_of(systematic_errors(state, params),
                     solver::pose_covariance<Scalar>(Scalar(1), range, state.position_m / range, noise_ratio));
}

template <typename Scalar>
ErrorBudget<Scalar> budget_of(const SystematicErrors<Scalar>& errors, const Mat6<Scalar>& covariance, Scalar measured_share) {
    const Scalar position_variance = covariance.template topLeftCorner<3, 3>().trace();
    const Scalar rotation_variance = covariance.template bottomRightCorner<3, 3>().trace();
    const PoseError<Scalar> sum = errors.sum();
    ErrorBudget<Scalar> budget;
    budget.linearization = term(errors.linearization);
    budget.frame_propagation = term(errors.frame_propagation);
    budget.skew = term(errors.skew);
    budget.blur = term(errors.blur);
    budget.latency = term(errors.latency);
    budget.noise = {std::sqrt(position_variance), std::sqrt(rotation_variance)};
    const Scalar left = std::max(1 - measured_share, Scalar(0));
    budget.total = {std::sqrt(sum.template head<3>().squaredNorm() + left * position_variance),
                    std::sqrt(sum.template tail<3>().squaredNorm() + left * rotation_variance)};
    return budget;
}

template SystematicErrors<float> systematic_errors(const MotionState<float>&, const BudgetParams<float>&);
template ErrorBudget<float> error_budget(const MotionState<float>&, float, const BudgetParams<float>&);
template SystematicErrors<float> timing_errors(const MotionState<float>&, const BoardTiming<float>&);
template ErrorBudget<float> budget_of(const SystematicErrors<float>&, const Mat6<float>&, float);
#if TRICOIL_SCALARS & 2  // double
template SystematicErrors<double> systematic_errors(const MotionState<double>&, const BudgetParams<double>&);
template ErrorBudget<double> error_budget(const MotionState<double>&, double, const BudgetParams<double>&);
template SystematicErrors<double> timing_errors(const MotionState<double>&, const BoardTiming<double>&);
template ErrorBudget<double> budget_of(const SystematicErrors<double>&, const Mat6<double>&, double);
#endif

}  // namespace tricoil::error_model

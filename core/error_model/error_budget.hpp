// The error to expect of one pose, term by term: from how the sensor moves, when the board samples and how the pose is solved.
#pragma once

#include <cstdint>

#include "core/error_model/board_timing.hpp"
#include "core/error_model/motion_state.hpp"
#include "core/error_model/sampling_error.hpp"

namespace tricoil::error_model {

/// Sizes of one error: length of the position error, angle of the attitude error.
template <typename Scalar>
struct ErrorTerm {
    Scalar position_m = 0;
    Scalar rotation_rad = 0;
};

/// What travels with a pose. All terms but the noise are systematic: they have a direction and add up as vectors. Noise is the
/// root mean square of the Cramer-Rao bound. total = root of |sum of systematic terms|^2 + noise^2.
template <typename Scalar>
struct ErrorBudget {
    ErrorTerm<Scalar> linearization;
    ErrorTerm<Scalar> frame_propagation;
    ErrorTerm<Scalar> skew;
    ErrorTerm<Scalar> blur;
    ErrorTerm<Scalar> latency;
    ErrorTerm<Scalar> noise;
    ErrorTerm<Scalar> total;
};

/// How the poses are solved: which of the paper's error terms exist.
enum class SolverForm : std::uint8_t {
    direct,            // closed form: neither linearization nor frame propagation
    previous_vectors,  // previous-measurement technique without poles: linearization
    previous_angles,   // the paper's angle form: both
};

template <typename Scalar>
struct BudgetParams {
    BoardTiming<Scalar> timing;
    SolverForm solver = SolverForm::direct;
    int passes = 1;  // of the previous-measurement step per pose: a second one leaves next to nothing of the first one's error
};

/// The systematic errors as vectors, true minus measured, source frame.
template <typename Scalar>
struct SystematicErrors {
    PoseError<Scalar> linearization = PoseError<Scalar>::Zero();
    PoseError<Scalar> frame_propagation = PoseError<Scalar>::Zero();
    PoseError<Scalar> skew = PoseError<Scalar>::Zero();
    PoseError<Scalar> blur = PoseError<Scalar>::Zero();
    PoseError<Scalar> latency = PoseError<Scalar>::Zero();

    [[nodiscard]] PoseError<Scalar> sum() const { return linearization + frame_propagation + skew + blur + latency; }
};

template <typename Scalar>
SystematicErrors<Scalar> systematic_errors(const MotionState<Scalar>& state, const BudgetParams<Scalar>& params);

/// What the board's timing alone makes of a motion, whatever solves: skew, blur, latency.
template <typename Scalar>
SystematicErrors<Scalar> timing_errors(const MotionState<Scalar>& state, const BoardTiming<Scalar>& timing);

/// Errors as a user reads them, with the noise given as the covariance of the pose (position m, small rotation rad).
template <typename Scalar>
ErrorBudget<Scalar> budget_of(const SystematicErrors<Scalar>& errors, const Mat6<Scalar>& covariance);

/// noise_ratio: sigma / k, per-entry noise over the coupling strength at this pose. Not a number where the motion leaves the
/// linearised solver's domain.
template <typename Scalar>
ErrorBudget<Scalar> error_budget(const MotionState<Scalar>& state, Scalar noise_ratio, const BudgetParams<Scalar>& params);

extern template SystematicErrors<float> systematic_errors(const MotionState<float>&, const BudgetParams<float>&);
extern template SystematicErrors<double> systematic_errors(const MotionState<double>&, const BudgetParams<double>&);
extern template ErrorBudget<float> error_budget(const MotionState<float>&, float, const BudgetParams<float>&);
extern template ErrorBudget<double> error_budget(const MotionState<double>&, double, const BudgetParams<double>&);
extern template SystematicErrors<float> timing_errors(const MotionState<float>&, const BoardTiming<float>&);
extern template SystematicErrors<double> timing_errors(const MotionState<double>&, const BoardTiming<double>&);
extern template ErrorBudget<float> budget_of(const SystematicErrors<float>&, const Mat6<float>&);
extern template ErrorBudget<double> budget_of(const SystematicErrors<double>&, const Mat6<double>&);

}  // namespace tricoil::error_model

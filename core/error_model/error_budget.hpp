// Error budget of one pose: predicted error terms for a given motion, board timing and solver.
#pragma once

#include <cstdint>

#include "core/error_model/board_timing.hpp"
#include "core/error_model/motion_state.hpp"
#include "core/error_model/sampling_error.hpp"

namespace tricoil::error_model {

/// Magnitude of one error: length of the position error, angle of the attitude error.
template <typename Scalar>
struct ErrorTerm {
    Scalar position_m = 0;
    Scalar rotation_rad = 0;
};

/// Error terms of a pose. All terms except noise are systematic: they have a direction and add as vectors. Noise is the root mean
/// square of the Cramer-Rao bound. total = sqrt(|sum of systematic terms|^2 + noise^2).
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

/// Form of the solver. It decides which of the paper's error terms exist.
enum class SolverForm : std::uint8_t {
    direct,            // closed form: no linearization error, no frame propagation
    previous_vectors,  // pole-free previous-measurement technique: linearization error
    previous_angles,   // the paper's angle form: both terms
};

template <typename Scalar>
struct BudgetParams {
    BoardTiming<Scalar> timing;
    SolverForm solver = SolverForm::direct;
    int passes = 1;  // previous-measurement steps per pose; a second pass removes nearly all error of the first
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

/// Errors that depend only on the motion and the board's timing, not on the solver: skew, blur, latency.
template <typename Scalar>
SystematicErrors<Scalar> timing_errors(const MotionState<Scalar>& state, const BoardTiming<Scalar>& timing);

/// Magnitudes of the errors. `covariance`: noise of the pose (position m, small rotation rad). measured_share: share of the
/// noise that the squares of the systematic errors already contain, because these errors were computed from noisy measurements.
template <typename Scalar>
ErrorBudget<Scalar> budget_of(const SystematicErrors<Scalar>& errors, const Mat6<Scalar>& covariance, Scalar measured_share = 0);

/// noise_ratio: sigma / k, noise of one entry divided by the coupling strength at this pose. The result is NaN if the motion is
/// too large for the linearised solver.
template <typename Scalar>
ErrorBudget<Scalar> error_budget(const MotionState<Scalar>& state, Scalar noise_ratio, const BudgetParams<Scalar>& params);

}  // namespace tricoil::error_model

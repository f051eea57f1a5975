// Groups of checks. Each adds its rows to the report. Known answers come from an independent computation in double.
#pragma once

#include "core/selfcheck/report.hpp"

namespace tricoil::selfcheck {

/// Rotations, angles, quaternions.
template <typename Scalar>
void check_geometry(Report& report);

/// Signal matrix and its Jacobian.
template <typename Scalar>
void check_field(Report& report);

/// Direct solver.
template <typename Scalar>
void check_direct(Report& report);

/// Direct solver, covariance, previous-measurement step, and inputs that they must refuse.
template <typename Scalar>
void check_solver(Report& report);

/// The paper's examples, shortened: compares predicted and measured errors in open and closed loop, also at poles.
template <typename Scalar>
void check_examples(Report& report);

/// The paper's examples, the pole-free form and the error budget.
template <typename Scalar>
void check_error_model(Report& report);

/// Arithmetic of the processor: denormals, rounding, no excess precision.
template <typename Scalar>
void check_arithmetic(Report& report);

/// 64-bit time.
void check_times(Report& report);

/// Lock-in of a tone of known amplitude and phase.
template <typename Scalar>
void check_demodulator(Report& report);

}  // namespace tricoil::selfcheck

// Pose errors from sampling over time: multiplexing skew and blur of the window.
#pragma once

#include "core/error_model/board_timing.hpp"
#include "core/error_model/motion_state.hpp"

namespace tricoil::error_model {

/// True minus measured: position (m), then small rotation (rad), both in the source frame (attitude q -> exp(r) q).
template <typename Scalar>
using PoseError = Vec6<Scalar>;

/// Error of the least-squares solver if a signal matrix lacks `missing` (per coupling constant, 1/m^3), to first order:
/// (J^T J)^-1 J^T applied to `missing`.
template <typename Scalar>
PoseError<Scalar> matrix_error(const MotionState<Scalar>& state, const Mat3<Scalar>& missing);

/// Error at the time stamp if columns of different ages are solved as if they were simultaneous. The error of the measured
/// matrix is dX = X' diag(age). First order in age.
template <typename Scalar>
PoseError<Scalar> skew_error(const MotionState<Scalar>& state, const Vec3<Scalar>& column_age_s);

/// Error at the middle of a window: averaging over the window yields X + X'' tau^2 / 24. First order in tau^2.
template <typename Scalar>
PoseError<Scalar> blur_error(const MotionState<Scalar>& state, Scalar window_s);

/// Error of a pose that is used `latency_s` after its time stamp, because the sensor has moved.
template <typename Scalar>
PoseError<Scalar> latency_error(const MotionState<Scalar>& state, Scalar latency_s) {
    PoseError<Scalar> error;
    error << latency_s * state.velocity_m_s, latency_s * state.angular_rate_rad_s;
    return error;
}

}  // namespace tricoil::error_model

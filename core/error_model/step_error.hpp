// What one closed-loop previous-measurement step leaves of a motion: the error of the linearization (14), and the error of
// carrying the increments from the tracking frame into the source frame's angles, (17), (18).
#pragma once

#include <cstdint>

#include "core/error_model/motion_state.hpp"
#include "core/error_model/sampling_error.hpp"

namespace tricoil::error_model {

/// Where an update's increments are kept: this decides which second-order terms they leave.
enum class StepForm : std::uint8_t {
    vectors,  // unit vector and attitude matrix; roll from the mean of (16)'s two forms
    angles,   // the paper's angles; roll from W32
};

/// Linearization alone, exact for a constant velocity and turn over one update: the increments of (15), (16) with the exact R
/// against the true turn. Second order in the turn: mostly range, by -rho g^2 / 2 (37).
/// NaN if the sensor turns past the domain of the step (54.7 degrees) in one update.
template <typename Scalar>
PoseError<Scalar> linearization_error(const MotionState<Scalar>& state, Scalar update_s, StepForm form);

/// Frame propagation, to second order in the turn: (17) and (18) take the increments for rates at the old angles, but on a sphere
/// an azimuth changes the elevation too and Euler rates change while they turn. Grows as tan(beta), tan(theta): without bound
/// at the poles. Zero for the pole-free form.
template <typename Scalar>
PoseError<Scalar> frame_propagation_error(const MotionState<Scalar>& state, Scalar update_s);

extern template PoseError<float> linearization_error(const MotionState<float>&, float, StepForm);
extern template PoseError<double> linearization_error(const MotionState<double>&, double, StepForm);
extern template PoseError<float> frame_propagation_error(const MotionState<float>&, float);
extern template PoseError<double> frame_propagation_error(const MotionState<double>&, double);

}  // namespace tricoil::error_model

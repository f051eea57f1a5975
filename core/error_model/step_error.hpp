// Errors of one closed-loop previous-measurement step: linearization (14), and propagation of the increments from the tracking
// frame to the angles of the source frame, (17), (18).
#pragma once

#include <cstdint>

#include "core/error_model/motion_state.hpp"
#include "core/error_model/sampling_error.hpp"

namespace tricoil::error_model {

/// Representation of the pose to which an update adds its increments. It decides which second-order terms remain.
enum class StepForm : std::uint8_t {
    vectors,  // unit vector and attitude matrix; roll is the mean of the two forms of (16)
    angles,   // the paper's angles; roll from W32
};

/// Linearization error only, exact for constant velocity and angular rate over one update: increments of (15), (16) with the
/// exact R compared with the true turn. Second order in the turn, mostly in range: -rho g^2 / 2 (37). NaN if the sensor turns
/// beyond the domain of the step (54.7 degrees) in one update.
template <typename Scalar>
PoseError<Scalar> linearization_error(const MotionState<Scalar>& state, Scalar update_s, StepForm form);

/// Frame propagation error to second order in the turn. (17) and (18) use the increments as rates at the old angles. On a sphere,
/// however, a step in azimuth also changes the elevation, and Euler rates change during the turn. The error grows as tan(beta)
/// and tan(theta), without bound at the poles. It is zero for the pole-free form.
template <typename Scalar>
PoseError<Scalar> frame_propagation_error(const MotionState<Scalar>& state, Scalar update_s);

}  // namespace tricoil::error_model

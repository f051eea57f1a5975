#include "core/error_model/step_error.hpp"

#include <cmath>
#include <limits>

#include "core/base/precision.hpp"
#include "core/error_model/exact_step.hpp"
#include "core/geometry/angles.hpp"
#include "core/geometry/rotations.hpp"

namespace tricoil::error_model {

namespace {

/// Source frame to the tracking frame of a line of sight. Only the angle form depends on the direction of the transverse axes.
template <typename Scalar>
Mat3<Scalar> tracking_frame(const Vec3<Scalar>& position_m, StepForm form) {
    if (form == StepForm::angles) {
        const auto angles = geometry::to_spherical(position_m);
        return geometry::line_of_sight_rotation(angles.azimuth_rad, angles.elevation_rad);
    }
    const Vec3<Scalar> u = position_m.normalized();
    Mat3<Scalar> p;
    p << u.transpose(), geometry::transverse_axes(u).transpose();
    return p;
}

}  // namespace

template <typename Scalar>
PoseError<Scalar> linearization_error(const MotionState<Scalar>& state, Scalar update_s, StepForm form) {
    const Mat3<Scalar> p = tracking_frame<Scalar>(state.position_m - update_s * state.velocity_m_s, form);
    // O = O^ exp(-[w T]x): in the tracking frame Q = exp(-[P w T]x).
    const Vec3<Scalar> turn = p * (update_s * state.angular_rate_rad_s);
    const Scalar range = state.position_m.norm();
    const RelativePose<Scalar> relative{p * (state.position_m / range),
                                        geometry::rotation_vector_to_quaternion<Scalar>(-turn).toRotationMatrix()};
    const auto step = exact_increments(relative, range);
    if (!step.ok()) {
        return PoseError<Scalar>::Constant(std::numeric_limits<Scalar>::quiet_NaN());
    }
    const Vec3<Scalar> u = Vec3<Scalar>(1, step->position_azimuth, -step->position_elevation).normalized();
    Vec3<Scalar> rotation = step->rotation;
    if (form == StepForm::vectors) {
        rotation.x() = step->mean_roll;
    }
    PoseError<Scalar> error;
    error.template head<3>() = state.position_m - step->range_m * (p.transpose() * u);
    error.template tail<3>() = p.transpose() * (turn - rotation);
    return error;
}

template <typename Scalar>
PoseError<Scalar> frame_propagation_error(const MotionState<Scalar>& state, Scalar update_s) {
    const auto position = geometry::to_spherical(state.position_m);
    const auto attitude = geometry::to_euler(geometry::attitude_matrix(state.q_source_sensor));
    const Mat3<Scalar> p = geometry::line_of_sight_rotation(position.azimuth_rad, position.elevation_rad);
    const Vec3<Scalar> moved = p * (update_s * state.velocity_m_s) / position.range_m;
    const Scalar a0 = moved.y();   // turn of the line of sight towards the tracking frame's y
    const Scalar b0 = -moved.z();  // and towards its -z
    const Scalar tan_b = std::tan(position.elevation_rad);
    PoseError<Scalar> error;
    // A great circle, to second order: cos(beta^) d_alpha = a0 + a0 b0 tan(beta^), d_beta = b0 - a0^2 tan(beta^) / 2. (17)
    // contains only the first-order terms.
    const Vec3<Scalar> tracking(0, a0 * b0 * tan_b, a0 * a0 * tan_b / 2);
    error.template head<3>() = position.range_m * (p.transpose() * tracking);

    // For a constant rotation (p, q, s about the axes of the yawed frame): half the second derivatives of the Euler angles.
    const Mat3<Scalar> yaw = geometry::rotation_z(attitude.azimuth_rad);
    const Vec3<Scalar> turn = yaw * (update_s * state.angular_rate_rad_s);
    const Scalar tan_t = std::tan(attitude.elevation_rad);
    const Scalar psi_step = turn.z() + turn.x() * tan_t;
    const Vec3<Scalar> half(turn.y() * (psi_step + turn.x() * tan_t) / 2, -turn.x() * psi_step / 2, turn.x() * turn.y() / 2);
    error.template tail<3>() = yaw.transpose() * half;
    return error;
}

template PoseError<float> linearization_error(const MotionState<float>&, float, StepForm);
template PoseError<float> frame_propagation_error(const MotionState<float>&, float);
#if TRICOIL_SCALARS & 2  // double
template PoseError<double> linearization_error(const MotionState<double>&, double, StepForm);
template PoseError<double> frame_propagation_error(const MotionState<double>&, double);
#endif

}  // namespace tricoil::error_model

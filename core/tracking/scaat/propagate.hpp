// Moves the state through time: constant velocity and constant angular rate.
#pragma once

#include <algorithm>

#include "core/geometry/rotations.hpp"
#include "core/tracking/scaat/state.hpp"

namespace tricoil::tracking::scaat {

/// Spectral densities of the white accelerations: translation m^2/s^3, rotation rad^2/s^3.
template <typename Scalar>
struct Intensity {
    Scalar translation_m2_s3 = 0;
    Scalar rotation_rad2_s3 = 0;
};

/// Pose of `state` moved by dt (s, either sign) with its own rates; exact for constant rates.
template <typename Scalar>
void move_pose(State<Scalar>& state, Scalar dt) {
    state.position_m += dt * state.velocity_m_s;
    state.q_source_sensor = geometry::rotation_vector_to_quaternion<Scalar>(dt * state.rate_rad_s) * state.q_source_sensor;
    state.q_source_sensor.normalize();
}

/// P -> F P F^T + Q with F = [I, dt I; 0, I] in blocks of six and white acceleration of the given intensities over dt >= 0 (s).
/// Left out of F: the turn of a rotation error with the body, w dt (0.014 rad per slot at 10 rad/s), which changes no gain by more.
template <typename Scalar>
void grow_covariance(Mat12<Scalar>& p, const Intensity<Scalar>& q, Scalar dt) {
    auto pose = p.template topLeftCorner<6, 6>();
    auto cross = p.template topRightCorner<6, 6>();
    auto rate = p.template bottomRightCorner<6, 6>();
    const Mat6<Scalar> moved = cross + dt * rate;
    const Mat6<Scalar> pair = dt * (cross + moved.transpose());  // dt B + dt B^T + dt^2 D, symmetric up to rounding
    for (int j = 0; j < 6; ++j) {
        for (int i = 0; i <= j; ++i) {
            pose(i, j) += (pair(i, j) + pair(j, i)) / 2;
            pose(j, i) = pose(i, j);
        }
    }
    cross = moved;
    for (int i = 0; i < 6; ++i) {
        const Scalar intensity = i < 3 ? q.translation_m2_s3 : q.rotation_rad2_s3;
        pose(i, i) += intensity * dt * dt * dt / 3;
        cross(i, i) += intensity * dt * dt / 2;
        rate(i, i) += intensity * dt;
    }
    p.template bottomLeftCorner<6, 6>() = cross.transpose();
}

/// Longest time over which accelerations of consecutive intervals are taken as independent. A hand's are not: across a gap its
/// acceleration stays, the error grows with t^4 instead of t^3, and the intensity seen column by column is too small by t over this.
constexpr double kIndependent_s = 4e-3;

/// State and covariance at `time`, not before the state's own.
template <typename Scalar>
void propagate(State<Scalar>& state, const Intensity<Scalar>& q, DeviceTime time) {
    const auto dt = static_cast<Scalar>(to_seconds(time - state.time));
    move_pose(state, dt);
    const Scalar persistence = std::max(Scalar(1), dt / static_cast<Scalar>(kIndependent_s));
    grow_covariance(state.covariance, {q.translation_m2_s3 * persistence, q.rotation_rad2_s3 * persistence}, dt);
    state.time = time;
}

}  // namespace tricoil::tracking::scaat

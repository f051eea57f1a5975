// Propagation of the state in time: constant velocity and angular rate, plus slowly decaying mean accelerations.
#pragma once

#include <algorithm>
#include <array>

#include "core/geometry/rotations.hpp"
#include "core/geometry/unrolled.hpp"
#include "core/tracking/scaat/state.hpp"

namespace tricoil::tracking::scaat {

/// Spectral densities of the white accelerations: translation m^2/s^3, rotation rad^2/s^3.
template <typename Scalar>
struct Intensity {
    Scalar translation_m2_s3 = 0;
    Scalar rotation_rad2_s3 = 0;
};

/// Time constant with which a mean acceleration decays, because hands reverse their direction (motion at 6 Hz: 27 ms per radian).
/// This value and kAccelerationShare were chosen on half of the recorded hand motions; errors change by 3 % if either is halved
/// or doubled, on the other half as well.
constexpr double kAccelerationMemory_s = 0.1;
constexpr double kAccelerationShare = 0.3;
/// Largest rate at which velocity corrections are added to the acceleration. Without noise the gain would be one per column.
constexpr double kFastestLearning_per_s = 500;

/// Displacement in dt (s, either sign; rad for a rotation) from a velocity and an acceleration.
template <typename Scalar>
Vec3<Scalar> displacement(const Vec3<Scalar>& velocity, const Vec3<Scalar>& acceleration, Scalar dt) {
    return dt * velocity + (dt * dt / 2) * acceleration;
}

/// Moves `state` by dt >= 0 (s) with its rates and decayed accelerations; exact for constant rates.
template <typename Scalar>
void move(State<Scalar>& state, Scalar dt) {
    const Scalar kept = 1 / (1 + dt / Scalar(kAccelerationMemory_s));
    state.acceleration_m_s2 *= kept;
    state.angular_acceleration_rad_s2 *= kept;
    state.position_m += displacement<Scalar>(state.velocity_m_s, state.acceleration_m_s2, dt);
    const Vec3<Scalar> turn = displacement<Scalar>(state.rate_rad_s, state.angular_acceleration_rad_s2, dt);
    state.q_source_sensor = geometry::rotation_vector_to_quaternion<Scalar>(turn) * state.q_source_sensor;
    state.q_source_sensor.normalize();
    state.velocity_m_s += dt * state.acceleration_m_s2;
    state.rate_rad_s += dt * state.angular_acceleration_rad_s2;
}

/// P -> F P F^T + Q with F = [I, dt I; 0, I] in blocks of six and white acceleration of the given intensities over dt >= 0 (s).
/// F omits the rotation of an attitude error with the body, w dt (0.014 rad per slot at 10 rad/s); its effect on the gains is not
/// larger than that.
template <typename Scalar>
void grow_covariance(Mat12<Scalar>& p, const Intensity<Scalar>& q, Scalar dt) {
    auto pose = p.template topLeftCorner<6, 6>();
    auto cross = p.template topRightCorner<6, 6>();
    auto rate = p.template bottomRightCorner<6, 6>();
    for (int j = 0; j < 6; ++j) {
        for (int i = 0; i <= j; ++i) {
            const Scalar entry = pose(i, j) + dt * ((cross(i, j) + cross(j, i)) + dt * rate(i, j));
            pose(i, j) = entry;
            pose(j, i) = entry;
        }
    }
    for (int j = 0; j < 6; ++j) {
        for_each_of<6>([&]<int i>() {
            const Scalar entry = cross(i, j) + dt * rate(i, j);
            cross(i, j) = entry;
            p(j + 6, i) = entry;
        });
    }
    for (int i = 0; i < 6; ++i) {
        const Scalar intensity = i < 3 ? q.translation_m2_s3 : q.rotation_rad2_s3;
        pose(i, i) += intensity * dt * dt * dt / 3;
        cross(i, i) += intensity * dt * dt / 2;
        p(i + 6, i) = cross(i, i);
        rate(i, i) += intensity * dt;
    }
}

/// Longest time over which accelerations of consecutive intervals are treated as independent. Accelerations of a hand are
/// correlated: across a longer gap the acceleration stays, so the variance grows with t^4 instead of t^3, and the intensity
/// estimated per column is too small by the factor t / kIndependent_s.
constexpr double kIndependent_s = 4e-3;

/// Shares of velocity and rate corrections that are added to the accelerations (1/s), for a correction with the covariance p. In
/// an alpha-beta-gamma filter (Kalata 1984, gamma = beta^2/alpha) the acceleration gets beta/(alpha T) of each velocity
/// correction, the ratio of velocity gain to position gain: P_vp / P_pp, here from the traces. Only a part of it is used, because
/// the error state does not contain the uncertainty of the acceleration. With more noise both the filter and the learning are
/// slower.
template <typename Scalar>
std::array<Scalar, 2> acceleration_gains_per_s(const Mat12<Scalar>& p) {
    const auto gain = [&p](int block) {
        const Scalar ratio = p.template block<3, 3>(block, block + 6).trace() / p.template block<3, 3>(block, block).trace();
        return static_cast<Scalar>(kAccelerationShare) *
               std::clamp(ratio, Scalar(0), static_cast<Scalar>(kFastestLearning_per_s));
    };
    return {gain(0), gain(3)};
}

/// Adds a share of the velocity and rate corrections to the accelerations: corrections in a constant direction accumulate.
template <typename Scalar>
void learn_acceleration(State<Scalar>& state, const Vec12<Scalar>& correction, const std::array<Scalar, 2>& gains_per_s) {
    state.acceleration_m_s2 += gains_per_s[0] * correction.template segment<3>(6);
    state.angular_acceleration_rad_s2 += gains_per_s[1] * correction.template segment<3>(9);
}

/// Variance (sum of three axes) of the displacement in dt (s) by a change of the acceleration: its square changes by kDrift_per_s
/// of itself per second.
template <typename Scalar>
Scalar drift_variance(const Vec3<Scalar>& acceleration, Scalar dt) {
    constexpr Scalar kDrift_per_s = Scalar(4.8);
    return kDrift_per_s / 4 * acceleration.squaredNorm() * dt * dt * dt * dt * dt;
}

/// Predicts motion and pose covariance to `time` with constant acceleration; cancels the decay in move(). Motion is band-limited:
/// the change of the acceleration, and not the intensity, tells how fast a prediction becomes uncertain. With noise the intensity
/// is far too large for a longer time than that of a frame; kWhite is the part that remains. It and kDrift_per_s were chosen on
/// recorded motions of hands and fast ones, for noises of 0 to 0.5 mm (tests/bench/prediction_table).
template <typename Scalar>
void predict(State<Scalar>& state, const Intensity<Scalar>& q, DeviceTime time) {
    constexpr Scalar kWhite = Scalar(0.3);
    const Scalar dt = seconds_as<Scalar>(time - state.time);
    const Scalar drift = drift_variance(state.acceleration_m_s2, dt) / 3;
    const Scalar turn_drift = drift_variance(state.angular_acceleration_rad_s2, dt) / 3;
    const Scalar undecayed = 1 + dt / Scalar(kAccelerationMemory_s);
    state.acceleration_m_s2 *= undecayed;
    state.angular_acceleration_rad_s2 *= undecayed;
    move(state, dt);
    grow_covariance(state.covariance, {kWhite * q.translation_m2_s3, kWhite * q.rotation_rad2_s3}, dt);
    for (int i = 0; i < 6; ++i) {
        state.covariance(i, i) += i < 3 ? drift : turn_drift;
    }
    state.time = time;
}

/// Moves state and covariance to `time`, not before the state's own. Not inlined, so that its temporaries leave the stack.
template <typename Scalar>
[[gnu::noinline]] void propagate(State<Scalar>& state, const Intensity<Scalar>& q, DeviceTime time) {
    const Scalar dt = seconds_as<Scalar>(time - state.time);
    move(state, dt);
    const Scalar persistence = std::max(Scalar(1), dt / static_cast<Scalar>(kIndependent_s));
    grow_covariance(state.covariance, {q.translation_m2_s3 * persistence, q.rotation_rad2_s3 * persistence}, dt);
    state.time = time;
}

}  // namespace tricoil::tracking::scaat

// The paper's angles: spherical position and Euler attitude of the sensor, and their conversions.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/geometry/rotations.hpp"

namespace tricoil::geometry {

/// Position of the sensor in the source frame. Positive elevation points to -z (the Polhemus convention).
template <typename Scalar>
struct Spherical {
    Scalar range_m = 0;
    Scalar azimuth_rad = 0;    // alpha
    Scalar elevation_rad = 0;  // beta
};

/// Attitude as z-y-x Euler angles: O = Tx(roll) Ty(elevation) Tz(azimuth) converts source components to sensor components.
template <typename Scalar>
struct Euler {
    Scalar azimuth_rad = 0;    // psi
    Scalar elevation_rad = 0;  // theta
    Scalar roll_rad = 0;       // phi
};

/// P = Ty(beta) Tz(alpha): source frame to the frame whose x axis points to the sensor, (2).
template <typename Scalar>
Mat3<Scalar> line_of_sight_rotation(Scalar azimuth_rad, Scalar elevation_rad) {
    return rotation_y(elevation_rad) * rotation_z(azimuth_rad);
}

/// Unit vector to the sensor: the first row of P.
template <typename Scalar>
Vec3<Scalar> direction(Scalar azimuth_rad, Scalar elevation_rad) {
    const Scalar c = std::cos(elevation_rad);
    return {std::cos(azimuth_rad) * c, std::sin(azimuth_rad) * c, -std::sin(elevation_rad)};
}

template <typename Scalar>
Vec3<Scalar> to_cartesian(const Spherical<Scalar>& s) {
    return s.range_m * direction(s.azimuth_rad, s.elevation_rad);
}

/// Azimuth in (-pi, pi], elevation in [-pi/2, pi/2]. By definition, the azimuth at a pole and both angles at the origin are zero.
template <typename Scalar>
Spherical<Scalar> to_spherical(const Vec3<Scalar>& p) {
    return {p.norm(), std::atan2(p.y(), p.x()), std::atan2(-p.z(), std::hypot(p.x(), p.y()))};
}

/// O = Tx(phi) Ty(theta) Tz(psi), (6).
template <typename Scalar>
Mat3<Scalar> attitude_matrix(const Euler<Scalar>& e) {
    return rotation_x(e.roll_rad) * rotation_y(e.elevation_rad) * rotation_z(e.azimuth_rad);
}

/// Inverse of attitude_matrix with elevation in [-pi/2, pi/2]. By definition, roll is zero at the poles.
template <typename Scalar>
Euler<Scalar> to_euler(const Mat3<Scalar>& o) {
    const Scalar sine = std::clamp(-o(0, 2), Scalar(-1), Scalar(1));
    const Scalar cosine = std::hypot(o(0, 0), o(0, 1));
    const Scalar elevation = std::atan2(sine, cosine);
    if (cosine < 8 * std::numeric_limits<Scalar>::epsilon()) {
        return {std::atan2(-o(1, 0), o(1, 1)), elevation, Scalar(0)};
    }
    return {std::atan2(o(0, 1), o(0, 0)), elevation, std::atan2(o(1, 2), o(2, 2))};
}

/// q_source_sensor (v_source = q v_sensor), whose matrix is the transpose of O.
template <typename Scalar>
Quat<Scalar> attitude_quaternion(const Mat3<Scalar>& o) {
    return Quat<Scalar>(Mat3<Scalar>(o.transpose())).normalized();
}

template <typename Scalar>
Mat3<Scalar> attitude_matrix(const Quat<Scalar>& q_source_sensor) {
    return q_source_sensor.toRotationMatrix().transpose();
}

/// `angle` shifted by whole turns into [-pi, pi].
template <typename Scalar>
Scalar wrap_turns(Scalar angle_rad) {
    return std::remainder(angle_rad, 2 * std::numbers::pi_v<Scalar>);
}

}  // namespace tricoil::geometry

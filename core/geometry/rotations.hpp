// Passive elementary rotations (Table 1 of the paper) and small rotations.
#pragma once

#include <cmath>

#include "core/linear/quaternion.hpp"

namespace tricoil::geometry {

/// Table 1, about z: components of a fixed vector in a frame turned by `angle` (rad) about z.
template <typename Scalar>
Mat3<Scalar> rotation_z(Scalar angle) {
    const Scalar c = std::cos(angle);
    const Scalar s = std::sin(angle);
    return (Mat3<Scalar>() << c, s, 0, -s, c, 0, 0, 0, 1).finished();
}

/// Table 1, about y.
template <typename Scalar>
Mat3<Scalar> rotation_y(Scalar angle) {
    const Scalar c = std::cos(angle);
    const Scalar s = std::sin(angle);
    return (Mat3<Scalar>() << c, 0, -s, 0, 1, 0, s, 0, c).finished();
}

/// Table 1, about x.
template <typename Scalar>
Mat3<Scalar> rotation_x(Scalar angle) {
    const Scalar c = std::cos(angle);
    const Scalar s = std::sin(angle);
    return (Mat3<Scalar>() << 1, 0, 0, 0, c, s, 0, -s, c).finished();
}

/// [v]x, the matrix of the cross product: skew(v) w = v x w.
template <typename Scalar>
Mat3<Scalar> skew(const Vec3<Scalar>& v) {
    return (Mat3<Scalar>() << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0).finished();
}

/// a [v]x, without products with zero.
template <typename Scalar>
Mat3<Scalar> times_skew(const Mat3<Scalar>& a, const Vec3<Scalar>& v) {
    Mat3<Scalar> product;
    product.col(0) = v.z() * a.col(1) - v.y() * a.col(2);
    product.col(1) = v.x() * a.col(2) - v.z() * a.col(0);
    product.col(2) = v.y() * a.col(0) - v.x() * a.col(1);
    return product;
}

/// Active rotation by |r| (rad) about r, as a unit quaternion. Exact for any angle and smooth at zero.
template <typename Scalar>
Quat<Scalar> rotation_vector_to_quaternion(const Vec3<Scalar>& r) {
    const Scalar angle = r.norm();
    const Scalar half = angle / 2;
    const Scalar sinc = half < Scalar(1e-4) ? Scalar(0.5) - half * half / 12 : std::sin(half) / angle;
    Quat<Scalar> q;
    q.w() = std::cos(half);
    q.vec() = sinc * r;
    return q;
}

/// Rotation vector (rad, length at most pi) of a unit quaternion: inverse of rotation_vector_to_quaternion.
template <typename Scalar>
Vec3<Scalar> quaternion_to_rotation_vector(const Quat<Scalar>& q) {
    const Scalar sign = q.w() < 0 ? Scalar(-1) : Scalar(1);
    const Scalar sine = q.vec().norm();
    if (sine < Scalar(1e-6)) {
        return 2 * sign * q.vec();
    }
    return (2 * std::atan2(sine, sign * q.w()) / sine) * sign * q.vec();
}

/// Angle (rad, 0 to pi) of the rotation between two attitudes, both unit quaternions.
template <typename Scalar>
Scalar angle_between(const Quat<Scalar>& a, const Quat<Scalar>& b) {
    const Quat<Scalar> difference = a.conjugate() * b;
    return 2 * std::atan2(difference.vec().norm(), std::abs(difference.w()));
}

/// Two unit vectors that complete the unit vector `x` to a right-handed triad (x, e2, e3), as columns. Defined for every x.
template <typename Scalar>
Matrix<Scalar, 3, 2> transverse_axes(const Vec3<Scalar>& x) {
    // Duff et al. 2017, "Building an Orthonormal Basis, Revisited", JCGT 6(1): no branches and no pole.
    const Scalar sign = std::copysign(Scalar(1), x.z());
    const Scalar a = Scalar(-1) / (sign + x.z());
    const Scalar b = x.x() * x.y() * a;
    Matrix<Scalar, 3, 2> axes;
    axes.col(0) << 1 + sign * x.x() * x.x() * a, sign * b, -sign * x.x();
    axes.col(1) << b, sign + x.y() * x.y() * a, -x.y();
    return axes;
}

}  // namespace tricoil::geometry

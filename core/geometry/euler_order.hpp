// Euler angles in any axis order, for output. The core itself uses quaternions.
#pragma once

#include <array>
#include <cmath>

#include "core/linear/quaternion.hpp"

namespace tricoil::geometry {

/// Axes (0 x, 1 y, 2 z) of three successive turns about the body's axes: R = R_first(a) R_second(b) R_third(c).
using AxisOrder = std::array<int, 3>;

/// Angles a, b, c (rad) of the rotation q for three different axes; a and c in (-pi, pi], b in [-pi/2, pi/2]. At b = +-90 degrees
/// only a + c or a - c is determined; c is then set to zero. From the entries of R = R_i(a) R_j(b) R_k(c), with s = +1 for cyclic
/// orders and -1 otherwise: R_ik = s sin b, R_jk = -s sin a cos b, R_kk = cos a cos b, R_ij = -s cos b sin c, R_ii = cos b cos c.
template <typename Scalar>
Vec3<Scalar> euler_angles(const Quat<Scalar>& q, const AxisOrder& order) {
    const auto [i, j, k] = order;
    const Scalar s = (j - i + 3) % 3 == 1 ? Scalar(1) : Scalar(-1);
    const Mat3<Scalar> r = q.normalized().toRotationMatrix();
    const Scalar cosine = std::hypot(r(i, i), r(i, j));
    const Scalar b = std::atan2(s * r(i, k), cosine);
    constexpr Scalar kPole = Scalar(1e-6);
    if (cosine < kPole) {
        return {std::atan2(s * r(k, j), r(j, j)), b, Scalar(0)};
    }
    return {std::atan2(-s * r(j, k), r(k, k)), b, std::atan2(-s * r(i, j), r(i, i))};
}

}  // namespace tricoil::geometry

// Raab's closed form, for comparison (F. H. Raab, "Quasi-static magnetic-field technique for
// determining position and orientation", IEEE Trans. Geoscience and Remote Sensing GE-19(4), 1981), written from its equations.
#pragma once

#include <cmath>

#include "core/linear/matrix.hpp"

namespace tricoil::bench {

struct RaabPose {
    Vec3<double> position_m;  // up to its sign, like every solution for concentric triads
    Mat3<double> attitude;    // O, not orthonormalised: orthonormal only without noise
};

/// S = X^T X does not depend on the attitude: S = k^2 (3/4 u u^T + 1/4 I). Its trace, 3/2 k^2, gives the range. Its diagonal
/// gives the squares of the direction's components, and its off-diagonal elements give their signs relative to the largest one.
/// Then O = X D(u)^-1 / k with D^-1 = 3 u u^T - 2 I.
inline RaabPose solve_raab(const Mat3<double>& x, double coupling_constant) {
    const Mat3<double> s = x.transpose() * x;
    const double k_squared = s.trace() / 1.5;
    Vec3<double> u;
    for (int i = 0; i < 3; ++i) {
        u(i) = std::sqrt(std::max(0.0, (4 * s(i, i) / k_squared - 1) / 3));
    }
    Index largest = 0;
    u.maxCoeff(&largest);
    for (Index i = 0; i < 3; ++i) {
        if (i != largest && s(i, largest) < 0) {
            u(i) = -u(i);
        }
    }
    const double k = std::sqrt(k_squared);
    return {std::cbrt(coupling_constant / k) * u, x * (3 * u * u.transpose() - 2 * Mat3<double>::Identity()) / k};
}

}  // namespace tricoil::bench

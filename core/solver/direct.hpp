// Direct solver: pose from one signal matrix in closed form, the maximum-likelihood pose for equal noise on the nine entries.
#pragma once

#include "core/base/status.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::solver {

/// Pose and diagnostics. One signal matrix does not determine the hemisphere (sign of `direction`): D(u) = D(-u).
template <typename Scalar>
struct DirectSolution {
    Scalar strength;         // k, in coupling units
    Scalar range_m;          // (C / k)^(1/3)
    Vec3<Scalar> direction;  // u, unit vector to the sensor in the source frame; sign undetermined
    Mat3<Scalar> attitude;   // O: source components to sensor components; a proper rotation only if right_handed
    Scalar misfit_squared;   // squared Frobenius distance of X to the nearest dipole matrix: 3 degrees of freedom
    bool right_handed;       // det X > 0; otherwise a coil is reversed or two are swapped

    /// Position in the half space towards `side`, source frame.
    [[nodiscard]] Vec3<Scalar> position_towards(const Vec3<Scalar>& side) const {
        return (direction.dot(side) < 0 ? -range_m : range_m) * direction;
    }
};

/// Uses singular values and vectors of X (von Neumann's trace inequality; cf. Kim, Song, Park, IEEE TIE 65(5), 2018).
/// With X = U diag(s1, s2, s3) V^T: k = 2/3 (s1 + (s2 + s3)/2), u = +-v1, O = U diag(1, -1, -1) V^T.
/// Errors: not_finite (NaN or infinity in X), degenerate (X is zero, or of rank one or two).
template <typename Scalar>
Result<DirectSolution<Scalar>> solve_direct(const Mat3<Scalar>& x, Scalar coupling_constant);

}  // namespace tricoil::solver

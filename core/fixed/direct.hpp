// Direct solver in integers for processors without floating-point unit. Twin of solver::solve_direct.
#pragma once

#include "core/base/status.hpp"
#include "core/fixed/block_matrix.hpp"

namespace tricoil::fixed {

/// Length up to 8 m in steps of 4 nm.
using Metres = Fixed<28>;

struct DirectSolution {
    Scaled strength;       // k, in coupling units
    Metres range_m;        // (C / k)^(1/3); saturates at 8 m
    Vec3<Unit> direction;  // u; the sign is undetermined
    Mat3<Unit> attitude;   // O; a proper rotation only if right_handed
    Unit misfit_share;     // squared distance of X to the nearest dipole matrix, relative to |X|^2; at most one
    bool right_handed;     // det X > 0
};

/// coupling_constant: C, normalised and positive. Maximum-likelihood solution for dipole matrices with noise. For matrices far
/// from any dipole (saturated entries, random signs) the squared misfit exceeds the minimum by up to 1e-4 of |X|^2. Errors:
/// invalid_argument (C is not positive), degenerate (X is zero, or, after scaling by a power of two to a largest entry
/// from 1/2 to 1, the product of its two smaller singular values is below 2^-12).
Result<DirectSolution> solve_direct(const BlockMatrix& x, Scaled coupling_constant);

}  // namespace tricoil::fixed

// Pole-free previous-measurement step in integers. Twin of solver::step_vectors.
#pragma once

#include "core/fixed/direct.hpp"

namespace tricoil::fixed {

struct VectorPose {
    Metres range_m = 1;
    Vec3<Unit> direction = Vec3<Unit>(1, 0, 0);
    Mat3<Unit> attitude = Mat3<Unit>::Identity();
};

constexpr int kMaxPasses = 10;

/// Increments (15), (16), applied as small rotations of u and O.
/// Errors: invalid_argument (C is not positive, passes outside 1-10, or the previous pose is not a unit vector with a rotation),
/// degenerate (X is zero), not_converged (W11 below 1/16 of the largest entry's power of two, or an increment above one: the
/// previous pose is too far away).
Result<VectorPose> step_vectors(const BlockMatrix& x, Scaled coupling_constant, const VectorPose& previous, int passes = 1);

}  // namespace tricoil::fixed

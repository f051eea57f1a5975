// Direct solver for couplings that contain those of metal at rest.
#pragma once

#include "core/field/induced_dipole.hpp"
#include "core/solver/direct.hpp"

namespace tricoil::solver {

/// Solves X minus the couplings that the dipoles add at the last solution, from `position_m` and attitude `o` on, until the
/// solution no longer changes. `direction` has the sign that is nearer to `position_m`. Errors: those of solve_direct;
/// not_converged (no solution near the start, or the metal dominates).
template <typename Scalar>
Result<DirectSolution<Scalar>> solve_near_metal(const field::InducedDipoles<Scalar>& metal, const Mat3<Scalar>& x,
                                                Scalar coupling_constant, const Vec3<Scalar>& position_m, const Mat3<Scalar>& o);

}  // namespace tricoil::solver

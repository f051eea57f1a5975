// Cold start: pose from one signal matrix of real coils without a previous pose.
#pragma once

#include "core/solver/refine.hpp"

namespace tricoil::solver {

/// Coil offsets distinguish p from -p if they are large compared with noise times range. Concentric coils never distinguish them;
/// without a given hemisphere the result may be either.
template <typename Scalar>
struct ColdStartParams {
    int passes = 5;                                  // corrected direct solutions per hemisphere
    Vec3<Scalar> hemisphere = Vec3<Scalar>::Zero();  // direction to the half space of the sensor; zero: unknown
    /// A misfit below this share of refine.max_misfit_share is accepted. Otherwise the other hemisphere is refined too, and the
    /// better result is used.
    Scalar clear_share = Scalar(1e-3);
    RefineParams<Scalar> refine;
};

template <typename Scalar>
struct ColdSolution {
    Minimum<Scalar> refinement;  // of the best start
    int starts = 0;              // number of refinements
    int iterations = 0;          // of all refinements together
    bool right_handed = true;    // false: a coil is reversed or two are swapped, and the pose is meaningless
};

/// Starts from the direct solutions of both hemispheres. The couplings that they solve are without the gains, and without the
/// difference between general and concentric model at the last solution (`passes` times). Refines the better solution, and the
/// other one unless the first misfit is clearly small (clear_share). If no refinement converged, or none is clear near the coils,
/// it also starts from other directions. refinement.converged() is false if none converged. Errors: as refine and solve_direct;
/// not_finite also if the moments or the sensitivities are linearly dependent.
template <typename Scalar>
Result<ColdSolution<Scalar>> solve_cold(const field::GeneralDipole<Scalar>& model, const Mat3<Scalar>& x,
                                        const Mat3<Scalar>& weights, const ColdStartParams<Scalar>& params = {});

}  // namespace tricoil::solver

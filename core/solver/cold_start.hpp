// Pose from one signal matrix of real coils without any previous pose.
#pragma once

#include "core/solver/refine.hpp"

namespace tricoil::solver {

/// What is known of the half space that the sensor is in. Offsets of the coils tell p from -p where they are large against noise
/// times range; concentric coils never do, and a start that knows nothing then takes either.
template <typename Scalar>
struct ColdStartParams {
    int passes = 5;                                  // corrected direct solutions per hemisphere
    Vec3<Scalar> hemisphere = Vec3<Scalar>::Zero();  // points into the half space of the sensor; zero: unknown
    Scalar clear_share = Scalar(1e-3);  // a misfit below this share of refine.max_misfit_share is beyond doubt; above it the
                                        // other hemisphere is refined as well and the better one taken
    RefineParams<Scalar> refine;
};

template <typename Scalar>
struct ColdSolution {
    Minimum<Scalar> refinement;  // of the best start
    int starts = 0;              // refinements run
    int iterations = 0;          // of all of them together
    bool right_handed = true;    // otherwise a coil is reversed or two are swapped, and the pose means nothing
};

/// The direct solution on couplings from which gains and the difference of general and concentric model have been taken, the
/// latter at the last solution: `passes` times, from a first solution on the gain-corrected couplings. `towards`: half space.
/// Errors: as solve_direct; not_finite also if the moments or the sensitivities are linearly dependent.
template <typename Scalar>
Result<RigidPose<Scalar>> corrected_direct(const field::GeneralDipole<Scalar>& model, const Mat3<Scalar>& x,
                                           const Vec3<Scalar>& towards, int passes);

/// Refines the better of both hemispheres' corrected direct solutions; where that does not converge, further starts near both.
/// refinement.converged() is false when none did. Errors: as refine and corrected_direct.
template <typename Scalar>
Result<ColdSolution<Scalar>> solve_cold(const field::GeneralDipole<Scalar>& model, const Mat3<Scalar>& x,
                                        const Mat3<Scalar>& weights, const ColdStartParams<Scalar>& params = {});

extern template Result<RigidPose<float>> corrected_direct(const field::GeneralDipole<float>&, const Mat3<float>&,
                                                          const Vec3<float>&, int);
extern template Result<RigidPose<double>> corrected_direct(const field::GeneralDipole<double>&, const Mat3<double>&,
                                                           const Vec3<double>&, int);
extern template Result<ColdSolution<float>> solve_cold(const field::GeneralDipole<float>&, const Mat3<float>&, const Mat3<float>&,
                                                       const ColdStartParams<float>&);
extern template Result<ColdSolution<double>> solve_cold(const field::GeneralDipole<double>&, const Mat3<double>&,
                                                        const Mat3<double>&, const ColdStartParams<double>&);

}  // namespace tricoil::solver

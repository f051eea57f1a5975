// Fits virtual dipoles to couplings at known places near metal that is at rest relative to the source.
#pragma once

#include <vector>

#include "board/host/calibration/surroundings_residual.hpp"

namespace tricoil::host {

/// Couplings near metal, and what is known of their poses.
struct SurroundingsData {
    std::vector<PlacedCouplings> poses;
    FrameStarts starts;
    RigidBlock frame{};           // start values of the blocks
    RigidBlock mount{};           //
    bool fixtures_known = true;   // false: both blocks are estimated
    bool attitudes_known = true;  // false (grid): every attitude is estimated, and the rotation of the mount is fixed
};

struct SurroundingsFit {
    std::vector<VirtualDipole> dipoles;
    Rigid frame;                   // stage or grid to source components
    Rigid mount;                   // sensor to mount components
    double residual_before_m = 0;  // RMS of the weighted residuals of a pose without dipoles, with the same unknowns
    double residual_m = 0;         // with them
    std::vector<solver::RigidPose<double>> truths;  // by pose
    std::vector<VirtualDipole> quadrature;          // the same of the quadratures; empty if unknown or too small
    double quadrature_deviation = 0;                // of the ratio of their couplings to the measured ones
};

/// Adds dipoles one by one, at most field::kMaxInducedDipoles, each where it explains most of the residual, and fits all of them
/// together, while the standard deviation of the residuals falls by a tenth or more. Dipoles stay away from source and poses.
/// The dipoles of the quadratures start at the same places. Throws InputError for fewer than 18 places, places in one plane,
/// couplings that dipoles do not explain better than the coils alone, and no convergence.
SurroundingsFit fit_surroundings(const field::GeneralDipole<double>& coils, const SurroundingsData& data);

}  // namespace tricoil::host

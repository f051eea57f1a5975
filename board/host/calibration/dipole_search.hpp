// Search for the place at which one more virtual dipole explains most of the residuals.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "board/host/calibration/surroundings_residual.hpp"

namespace tricoil::host {

/// Linearised fit at the present solution.
struct LinearisedPose {
    solver::RigidPose<double> pose;
    Matrix<double, 9, 9> weight;
    Eigen::Matrix<double, 9, 1> residual;               // weighted
    Eigen::Matrix<double, 9, Eigen::Dynamic> nuisance;  // weighted; of unknowns that all poses share
    Eigen::Matrix<double, 9, Eigen::Dynamic> own;       // weighted; of unknowns of this pose
};

using DipoleBlock = std::array<double, kDipole>;

/// The best of a grid of places around source and poses, none nearer than `clearance_m` to them, with the polarisability that
/// least squares gives there.
DipoleBlock best_dipole(const field::GeneralDipole<double>& coils, std::vector<LinearisedPose> poses, double clearance_m);

}  // namespace tricoil::host

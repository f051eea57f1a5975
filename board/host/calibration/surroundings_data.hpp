// Input of the fit of the surroundings: from poses on a stage, or from a printed grid.
#pragma once

#include <vector>

#include "board/host/calibration/frame_file.hpp"
#include "board/host/calibration/surroundings_fit.hpp"
#include "core/solver/cold_start.hpp"

namespace tricoil::host {

/// Poses on the stage of the calibration. Throws InputError for fixtures that the calibration lacks.
SurroundingsData data_at_known_fixtures(const CalibrationFile& coils, std::vector<PoseFile> files);

/// Poses on a stage at unknown places of source and sensor on it. Throws InputError for files with several fixtures, and like
/// with_refitted_fixtures.
SurroundingsData data_at_unknown_fixtures(const CalibrationFile& coils, std::vector<PoseFile> files);

/// Nodes of a printed grid in any attitudes. hemisphere: half space of the grid. Throws InputError for couplings without a pose.
SurroundingsData data_on_grid(const CalibrationFile& coils, const std::vector<GridFrame>& frames, double spacing_m,
                              const Vec3<double>& hemisphere);

/// Pose from couplings that metal distorts: solve_cold() with equal weights, which accepts a misfit of 30 % of the couplings.
/// hemisphere: half space of the sensor. The result may be left-handed or not converged. Errors: as solve_cold().
Result<solver::ColdSolution<double>> solve_tolerant(const field::GeneralDipole<double>& model, const Mat3<double>& x,
                                                    const Vec3<double>& hemisphere);

}  // namespace tricoil::host

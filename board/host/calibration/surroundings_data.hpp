// Input of the fit of the surroundings: from poses on a stage, or from a printed grid.
#pragma once

#include <optional>
#include <vector>

#include "board/host/calibration/frame_file.hpp"
#include "board/host/calibration/surroundings_fit.hpp"

namespace tricoil::host {

/// Poses on the stage of the calibration. Throws InputError for fixtures that the calibration lacks.
SurroundingsData data_at_known_fixtures(const CalibrationFile& coils, std::vector<PoseFile> files);

/// Poses on a stage at unknown places of source and sensor on it. Throws InputError for files with several fixtures, and like
/// with_refitted_fixtures.
SurroundingsData data_at_unknown_fixtures(const CalibrationFile& coils, std::vector<PoseFile> files);

/// Nodes of a printed grid in any attitudes. hemisphere: half space of the grid. Throws InputError for couplings without a pose.
SurroundingsData data_on_grid(const CalibrationFile& coils, const std::vector<GridFrame>& frames, double spacing_m,
                              const Vec3<double>& hemisphere);

/// Errors of the poses that a model gives for the couplings.
struct ModelErrors {
    double position_rms_m = 0;
    double position_max_m = 0;
    double misfit_max = 0;          // largest share of the couplings that no pose explains
    std::size_t not_converged = 0;  // not in the figures above
    std::vector<double> error_m;    // by pose; infinite without convergence
};
ModelErrors errors_of_model(const field::GeneralDipole<double>& model, const SurroundingsData& data,
                            const std::vector<solver::RigidPose<double>>& truths);

/// Index of a pose whose error is far above that of the others, or that has no solution.
std::optional<std::size_t> find_outlier(const ModelErrors& errors, const std::vector<solver::RigidPose<double>>& truths);

}  // namespace tricoil::host

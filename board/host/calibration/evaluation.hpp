// Pose errors of a calibrated tracker against a stage.
#pragma once

#include <string>
#include <vector>

#include "board/host/calibration/pose_set.hpp"
#include "board/support/calibration_file.hpp"

namespace tricoil::host {

enum class EvaluationSolver { direct, refined };

/// One pose: what the tracker says, what the stage says, both in the source frame.
struct PoseError {
    std::size_t file = 0;
    std::size_t line = 0;
    bool converged = false;
    int iterations = 0;
    Vec3<double> truth_m = Vec3<double>::Zero();
    Vec3<double> error_m = Vec3<double>::Zero();  // tracker minus stage
    Vec3<double> rotation_error_rad = Vec3<double>::Zero();
    double misfit_share = 0;  // of the couplings that the pose leaves unexplained
};

/// Solves every pose cold, with the calibration's hemisphere and nothing of the truth. Poses that do not converge are marked.
/// Throws InputError for a fixture that the calibration does not know (and names those it does), or couplings that are no pose.
std::vector<PoseError> evaluate(const CalibrationFile& calibration, const std::vector<PoseFile>& files, EvaluationSolver solver);

/// Fixtures fitted to these files with the magnetic parameters held: source and mounts of every file's names.
CalibrationFile with_refitted_fixtures(const CalibrationFile& calibration, const std::vector<PoseFile>& files,
                                       EvaluationSolver solver);

/// The affine map (about the identity) that takes the tracker's positions to the stage's; poses far off count nothing.
void fit_output_correction(CalibrationFile& calibration, const std::vector<PoseError>& errors);

}  // namespace tricoil::host

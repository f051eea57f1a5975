// Pose errors of a calibrated tracker relative to a stage.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "board/host/calibration/pose_set.hpp"
#include "board/support/calibration_file.hpp"

namespace tricoil::host {

enum class EvaluationSolver { direct, refined };

/// Error of one pose: tracker minus stage, source frame.
struct EvaluatedPose {
    std::size_t file = 0;
    std::size_t line = 0;
    bool converged = false;
    int iterations = 0;
    Vec3<double> truth_m = Vec3<double>::Zero();
    Vec3<double> error_m = Vec3<double>::Zero();  // tracker minus stage
    Vec3<double> rotation_error_rad = Vec3<double>::Zero();
    double misfit_share = 0;                       // share of the couplings that the pose does not explain
    double strength = 0;                           // k of the measured couplings
    Vec3<double> solved_m = Vec3<double>::Zero();  // by the coils, before a correction of the output
    // Covariance of the position that a tracker states without noise: of the misfit floor, and of the calibration's other errors.
    Mat3<double> of_floor = Mat3<double>::Zero();
    Mat3<double> of_others = Mat3<double>::Zero();
    double sigmas = 0;                          // of the position error by their sum
    double deviation_m = 0;                     // the position's (3D); 0: the calibration states nothing
    std::optional<double> surroundings_change;  // of their quadratures, as a share of the calibrated ones
    double unexplained_share = 0;               // that the true pose does not explain, at most 1
};

struct Fixtures {
    const Rigid& source_stage;
    const Rigid& mount_sensor;
};

/// Of this file. Throws InputError, with the known names, for a fixture that the calibration lacks.
Fixtures fixtures_of(const CalibrationFile& calibration, const PoseFile& file);

/// Solves every pose without a start pose, in the hemisphere of the true positions of its source fixture. Poses that do not
/// converge are marked. on_pose: called for each pose; may throw, or be empty. Throws InputError like fixtures_of(), and for
/// couplings without a pose.
std::vector<EvaluatedPose> evaluate(const CalibrationFile& calibration, const std::vector<PoseFile>& files,
                                    EvaluationSolver solver, const std::function<void()>& on_pose = {});

/// What trackers state for these poses without noise, with the numbers that `calibration` has now: of_floor to deviation_m.
void state_deviations(const calibration::Calibration<double>& calibration, std::vector<EvaluatedPose>& errors);

/// Calls use(index of the file, pose, true pose) for each pose. Throws InputError like fixtures_of().
void for_each_pose(const CalibrationFile& calibration, std::vector<PoseFile> files,
                   const std::function<void(std::size_t, const MeasuredPose&, const solver::RigidPose<double>&)>& use);

/// Corrects files whose couplings are transposed, or whose coils are reversed, relative to the calibration: a correlation with
/// the couplings at the true poses of more than 0.9 shows it. Prints a notice for each. Throws InputError if the calibration has
/// pick-up.
void correct_wiring(const CalibrationFile& calibration, std::vector<PoseFile>& files);

/// Fits the fixtures of these files, which it corrects like correct_wiring(), with fixed magnetic parameters.
CalibrationFile with_refitted_fixtures(const CalibrationFile& calibration, std::vector<PoseFile>& files, EvaluationSolver solver,
                                       const std::function<void()>& on_pose = {});

}  // namespace tricoil::host

// Fits magnetic parameters of both triads and the unknown fixtures to couplings at known stage poses.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "board/host/calibration/fixtures.hpp"
#include "board/host/calibration/pose_set.hpp"
#include "board/support/progress.hpp"
#include "core/field/general_dipole.hpp"

namespace tricoil::host {

enum class FitModel {
    concentric,  // gains and angles
    general,     // also a position for every coil
    finite,      // also a size for every coil (axial octupole)
};

inline const char* to_string(FitModel model) {
    return model == FitModel::concentric ? "concentric" : model == FitModel::general ? "general" : "finite";
}

enum class FixtureModel {
    free,   // every sensor fixture has its own position and rotation
    named,  // sensor fixtures have the rotations of their names and a common position
};

inline const char* to_string(FixtureModel fixtures) { return fixtures == FixtureModel::free ? "free" : "named"; }

enum class StageModel {
    ideal,
    turning,  // the first part of StageErrors
    room,     // all of StageErrors
};

struct FitOptions {
    FitModel model = FitModel::general;
    FixtureModel fixtures = FixtureModel::free;
    std::optional<StageModel> stage = std::nullopt;  // room for several mountings of the source, else ideal
    bool finds_pick_up = false;
    ShowShare progress = {};  // may be empty
};

/// Fitted parameter for output: name with unit, value, standard deviation.
struct FittedParameter {
    std::string name;
    double value = 0;
    double deviation = 0;
};

struct CalibrationFit {
    field::GeneralDipole<double> model;
    std::map<std::string, Rigid> source_stage;  // by fixture name
    std::map<std::string, Rigid> mount_sensor;
    bool stage_turns_left_handed = false;
    StageErrors stage_errors;
    Mat3<double> pick_up = Mat3<double>::Zero();  // in phase with the couplings; zero: not found
    double pick_up_sigma = 0;                     // standard deviation of each number
    std::vector<FittedParameter> parameters;
    calibration::CoilErrors<double> errors;
    double residual_rms = 0;  // of couplings, relative to the norm of each signal matrix, without outliers
    std::map<std::string, double> residual_rms_by_file;
    std::vector<std::string> warnings;  // large residuals, weakly determined parameters, fixtures that contradict their names
    std::map<std::string, FileWiring> wiring;  // by file that was used
    std::vector<std::string> outliers;         // FILE:LINE of poses whose residual exceeds eight medians of the residuals
    double condition = 0;                      // of the normalised Jacobian
    std::size_t poses = 0;
    double coupling_constant = 1;     // unit of the printed moments
    double start_position_rms_m = 0;  // of the closed-form start values
};

/// Levenberg-Marquardt (Ceres), starting from guess_start. Gauge: moments and sensitivities are symmetric matrices, the latter
/// with trace three; offsets of each side sum to zero; if the stage only turns about z, the first mount's offset along z is zero.
/// Residuals are weighted as the pose error that they would cause (metres; a rad counts as 0.1 m). The part that no pose explains
/// has half that weight. The scale of the Cauchy loss is four times the median of the residual norms. Throws InputError like
/// guess_start, and for unknown fixture names with FixtureModel::named, no convergence, parameters that the poses do not
/// determine, couplings that the model does not explain, and contradictory files (residuals of one file far above those of the
/// others).
///
/// Pick-up is kept if the couplings unexplained fall by a fifth and it is three times its standard deviation.
///
/// Several mountings of one source (source fixtures) are fitted alone, turned into one frame and fitted together. Of four or
/// more, one without which the others fit clearly better is left out, with a warning.
CalibrationFit fit_calibration(const std::vector<PoseFile>& files, const FitOptions& options);

/// Corrects the wiring of the files that the fit used, and removes the others (mountings that did not fit).
void correct_files(const CalibrationFit& fit, std::vector<PoseFile>& files);

}  // namespace tricoil::host

// Fits the magnetic parameters of both triads together with the unknown fixtures to couplings at known stage poses.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "board/host/calibration/fixtures.hpp"
#include "board/host/calibration/pose_set.hpp"
#include "core/field/general_dipole.hpp"

namespace tricoil::host {

enum class FitModel {
    concentric,  // gains and angles
    general,     // and a place for every coil
    finite,      // and a size (axial octupole)
};

enum class FixtureModel {
    free,   // every sensor fixture has a place and a rotation of its own
    named,  // sensor fixtures turn the sensor exactly as their names say, about one place
};

struct FitOptions {
    FitModel model = FitModel::general;
    FixtureModel fixtures = FixtureModel::free;
};

/// A fitted number as it is printed: value, standard deviation, unit.
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
    std::vector<FittedParameter> parameters;
    double residual_rms = 0;  // of couplings as share of their pose's strength, without refused lines
    std::map<std::string, double> residual_rms_by_file;
    std::vector<std::string> warnings;  // identifiability, mixed sets, fixtures that are not as named
    std::vector<std::string> outliers;  // FILE:LINE of poses that the robust loss set aside
    double condition = 0;               // of the normalised Jacobian
    std::size_t poses = 0;
    double coupling_constant = 1;     // unit of the printed moments
    double start_position_rms_m = 0;  // of the closed-form start
};

/// Name under which a file's fixture is kept: as the file says, else the file's own name.
std::string sensor_fixture_name(const PoseFile& file);
std::string source_fixture_name(const PoseFile& file);

/// Levenberg-Marquardt (Ceres) from guess_start. Gauge: moments and sensitivities are symmetric matrices, the latter with trace
/// three; offsets of each side sum to zero; where the stage only turns about z, the first mount's offset along z is zero.
/// Residuals are taken as the error of the pose that they would cause (metres; a rad counts as 0.1 m), what no pose explains with
/// half that weight. Cauchy loss at four times their median.
/// Throws InputError: as guess_start; unknown fixture names with FixtureModel::named; no convergence; parameters that the poses
/// do not determine; files that contradict each other (one whose residuals are far above the others').
CalibrationFit fit_calibration(const std::vector<PoseFile>& files, const FitOptions& options);

}  // namespace tricoil::host

// Kinds of `tricoil calibrate`. Each sets its result and throws InputError; some add warnings.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "board/host/calibration/calibration_fit.hpp"
#include "board/host/calibration/frame_file.hpp"
#include "board/support/calibration_file.hpp"
#include "board/support/json_text.hpp"
#include "core/signal/converter_errors.hpp"

namespace tricoil::host {

struct StageCommand {
    std::vector<std::string> data;
    FitModel model = FitModel::general;
    FixtureModel fixtures = FixtureModel::free;
    StageModel stage = StageModel::ideal;
    bool affine = false;
    bool converters = false;                    // also the errors of the board's converters
    signal::ConverterErrors stored_converters;  // those that --converters-from names; data with known levels are corrected
};

/// The coils and fixtures from couplings at known poses.
CalibrationFile calibrate_on_stage(const StageCommand& command, Json& result, std::vector<std::string>& warnings);
std::string stage_text(const Json& result);

struct FreeMotionCommand {
    std::vector<std::string> data;
    FitModel model = FitModel::concentric;
    double column_skew = 0;                     // see deskewed()
    std::optional<double> coupling_constant;    // gives the scale of all lengths
    std::optional<Vec3<double>> hemisphere;     // default: +x
    signal::ConverterErrors stored_converters;  // as above
};

/// Gains and angles (concentric), also positions (general) and sizes (finite) of the coils, from the column frames of all files.
/// Of files with poses of a stage, only the couplings are used.
CalibrationFile calibrate_free_motion(const FreeMotionCommand& command, Json& result, std::vector<std::string>& warnings);
std::string free_motion_text(const Json& result);

struct GridCommand {
    std::vector<std::string> data;
    FitModel model = FitModel::concentric;
    double spacing_m = 0;
    std::optional<GridSize> nodes;  // if the data are rests
    Vec3<double> hemisphere = Vec3<double>::UnitX();
    signal::ConverterErrors stored_converters;  // as above
};

/// The coils from column frames on the nodes of a printed grid.
CalibrationFile calibrate_grid(const GridCommand& command, Json& result, std::vector<std::string>& warnings);
std::string grid_text(const Json& result);

struct SurroundingsCommand {
    std::string calibration;  // of the coils
    std::vector<std::string> data;
    bool refit_fixtures = false;
    bool grid = false;
    double spacing_m = 0;
    std::optional<GridSize> nodes;
    Vec3<double> hemisphere{1, 0, 0};  // of the grid, if the calibration has none
};

/// The calibration of the coils with the surroundings.
CalibrationFile calibrate_surroundings(const SurroundingsCommand& command, Json& result);
std::string surroundings_result_text(const Json& result);

/// The calibration of the coils with the ratio of the bands. `recordings`: made in two bands, without metal. Only the first
/// sensor counts.
CalibrationFile calibrate_low_band(const std::string& calibration, const std::vector<std::string>& recordings, Json& result);
std::string low_band_text(const Json& result);

/// Calibrates the tip of a pointer, prints the result and writes it to `out`, if not empty. Returns the exit code.
int calibrate_pivot_command(const std::string& path, std::optional<std::uint8_t> sensor, const std::string& out, bool json);

}  // namespace tricoil::host

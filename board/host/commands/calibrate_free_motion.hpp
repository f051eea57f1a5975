// `tricoil calibrate --free-motion`.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "board/host/calibration/calibration_fit.hpp"
#include "board/support/calibration_file.hpp"
#include "board/support/json_text.hpp"
#include "core/signal/converter_errors.hpp"

namespace tricoil::host {

struct FreeMotionCommand {
    std::vector<std::string> data;
    FitModel model = FitModel::concentric;
    double column_skew = 0;                     // see deskewed()
    std::optional<double> coupling_constant;    // gives the scale of all lengths
    std::optional<Vec3<double>> hemisphere;     // default: +x
    signal::ConverterErrors stored_converters;  // those that --converters-from names; data with known levels are corrected
};

/// Gains and angles (concentric), also positions (general) and sizes (finite) of the coils, from the column frames of all files.
/// Of files with poses of a stage, only the couplings are used. Sets the result and adds warnings. Throws InputError.
CalibrationFile calibrate_free_motion(const FreeMotionCommand& command, Json& result, std::vector<std::string>& warnings);

std::string free_motion_text(const Json& result);

}  // namespace tricoil::host

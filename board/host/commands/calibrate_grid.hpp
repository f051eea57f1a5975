// `tricoil calibrate --grid`.
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

struct GridCommand {
    std::vector<std::string> data;
    FitModel model = FitModel::concentric;
    double spacing_m = 0;
    std::optional<GridSize> nodes;  // if the data are rests
    Vec3<double> hemisphere = Vec3<double>::UnitX();
    signal::ConverterErrors stored_converters;  // those that --converters-from names; data with known levels are corrected
};

/// The coils from column frames on the nodes of a printed grid. Sets the result and adds warnings. Throws InputError.
CalibrationFile calibrate_grid(const GridCommand& command, Json& result, std::vector<std::string>& warnings);

std::string grid_text(const Json& result);

}  // namespace tricoil::host

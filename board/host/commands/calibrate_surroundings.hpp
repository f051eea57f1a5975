// `tricoil calibrate --surroundings`.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "board/host/calibration/frame_file.hpp"
#include "board/support/calibration_file.hpp"
#include "board/support/json_text.hpp"

namespace tricoil::host {

struct SurroundingsCommand {
    std::string calibration;  // of the coils
    std::vector<std::string> data;
    bool refit_fixtures = false;
    bool grid = false;
    double spacing_m = 0;
    std::optional<GridSize> nodes;
    Vec3<double> hemisphere{1, 0, 0};  // of the grid, if the calibration has none
};

/// The calibration of the coils with the surroundings. Sets the result. Throws InputError.
CalibrationFile calibrate_surroundings(const SurroundingsCommand& command, Json& result);

std::string surroundings_result_text(const Json& result);

}  // namespace tricoil::host

// `tricoil calibrate` with poses of a stage.
#pragma once

#include <string>
#include <vector>

#include "board/host/calibration/calibration_fit.hpp"
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

/// The coils and fixtures from couplings at known poses. Sets the result and adds warnings. Throws InputError.
CalibrationFile calibrate_on_stage(const StageCommand& command, Json& result, std::vector<std::string>& warnings);

std::string stage_text(const Json& result);

}  // namespace tricoil::host

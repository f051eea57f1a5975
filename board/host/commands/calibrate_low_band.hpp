// `tricoil calibrate --low-band`.
#pragma once

#include <string>
#include <vector>

#include "board/support/calibration_file.hpp"
#include "board/support/json_text.hpp"

namespace tricoil::host {

/// The calibration of the coils with the ratio of the bands. `recordings`: made in two bands, without metal. Only the first
/// sensor counts. Sets the result. Throws InputError.
CalibrationFile calibrate_low_band(const std::string& calibration, const std::vector<std::string>& recordings, Json& result);

std::string low_band_text(const Json& result);

}  // namespace tricoil::host

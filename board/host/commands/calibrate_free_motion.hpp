// `tricoil calibrate --free-motion`.
#pragma once

#include <string>
#include <vector>

#include "board/support/calibration_file.hpp"
#include "board/support/json_text.hpp"

namespace tricoil::host {

/// Gains and angles from the frames of all files. column_skew: see deskewed(). Sets the result and adds warnings. Throws
/// InputError.
CalibrationFile calibrate_free_motion(const std::vector<std::string>& data, double column_skew, Json& result,
                                      std::vector<std::string>& warnings);

std::string free_motion_text(const Json& result);

}  // namespace tricoil::host

// Calibration of a tip, its result as JSON, and its file.
#pragma once

#include <string>

#include "board/host/calibration/pivot_poses.hpp"
#include "board/support/json_text.hpp"

namespace tricoil::host {

/// Calibrates the tip and writes it to `out`, if not empty. The result has tip, pivot, standard deviations, residuals and
/// warnings. Throws like calibrate_pivot() and write_whole_file().
Json pivot_result(const PivotRecord& record, const std::string& out);

}  // namespace tricoil::host

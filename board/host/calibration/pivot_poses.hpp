// Reads the poses of one sensor for the calibration of a tip: a CSV file, JSON lines or a recording.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "board/host/calibration/pivot.hpp"

namespace tricoil::host {

/// `path`: the folder of a recording, which has full covariances, or a file of `run --out` or of JSON lines, which has standard
/// deviations. `sensor`: empty: the only one in the file. Throws InputError, naming file and line: missing columns or keys,
/// numbers that are not a pose, a file without poses of the sensor, or several sensors of which none is selected.
PivotRecord read_pivot_poses(const std::string& path, std::optional<std::uint8_t> sensor);

}  // namespace tricoil::host

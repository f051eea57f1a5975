// Reads the poses of one sensor for the calibration of a tip: a CSV file, JSON lines or a recording.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/linear/quaternion.hpp"

namespace tricoil::host {

/// Pose of the sensor on a pointer, with its covariance.
struct PivotPose {
    Vec3<double> position_m = Vec3<double>::Zero();
    Quat<double> q_source_sensor = Quat<double>::Identity();
    Mat6<double> covariance = Mat6<double>::Zero();  // position (m), then small rotation (rad), source frame
};

struct PivotRecord {
    std::uint8_t sensor = 0;
    std::vector<PivotPose> poses;  // the valid ones, in the order of the file
    std::size_t invalid = 0;       // number of poses left out
};

/// `path`: the folder of a recording, which has full covariances, or a file of `run --out` or of JSON lines, which has standard
/// deviations. `sensor`: empty: the only one in the file. Throws InputError, naming file and line: missing columns or keys,
/// numbers that are not a pose, a file without poses of the sensor, or several sensors of which none is selected.
PivotRecord read_pivot_poses(const std::string& path, std::optional<std::uint8_t> sensor);

}  // namespace tricoil::host

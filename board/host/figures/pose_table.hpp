// Poses of a recording or a CSV file, for a picture.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "board/pose_text/output_format.hpp"
#include "core/linear/matrix.hpp"
#include "core/tracking/pose_flags.hpp"

namespace tricoil::host {

struct DrawnPose {
    double time_s = 0;
    bool valid = false;
    tracking::PoseFlags flags;
    Vec3<double> position_m = Vec3<double>::Zero();
    double deviation_m = 0;  // 3D standard deviation; NaN: unknown
    double error_m = 0;      // distance from the true position; NaN: unknown
};

/// By sensor.
using PoseTable = std::map<std::uint8_t, std::vector<DrawnPose>>;

/// `path`: the folder of a recording, or a CSV file with the columns of run --out or convert: time_us or time_s and x_m, y_m,
/// z_m; if present also sensor, valid, flags, std_x_m, std_y_m, std_z_m and error_position_m. stages: of the poses of a
/// recording; a CSV file has theirs already. Throws InputError, naming file and line.
PoseTable read_pose_table(const std::string& path, const OutputOptions& stages = {});

}  // namespace tricoil::host

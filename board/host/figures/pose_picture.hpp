// Picture of poses: path, position error or standard deviation, and flags over time.
#pragma once

#include <filesystem>

#include "board/host/figures/gnuplot.hpp"
#include "board/host/figures/pose_table.hpp"
#include "board/pose_text/pose_fields.hpp"

namespace tricoil::host {

/// Writes the curves as CSV files into `folder`. `file`: name of the picture, which ends with .svg or .png. A longer
/// table is reduced to 4,000 points per sensor: each has the first valid position and the largest error of its poses.
Picture pose_picture(const std::filesystem::path& folder, const std::string& file, const PoseTable& table,
                     const PoseUnits& units = {});

}  // namespace tricoil::host

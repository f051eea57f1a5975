// Couplings without poses: what a user without a stage records.
#pragma once

#include <string>
#include <vector>

#include "core/geometry/types.hpp"

namespace tricoil::host {

/// Reads CSV; columns before x11 (or m11) are left: any header that ends in x11,x12,x13,x21,...,x33 (or m11,...), xij: sensor
/// coil i, source coil j. Throws InputError, naming file and line.
std::vector<Mat3<double>> read_frames(const std::string& path);

/// Frames of multiplexed columns as if simultaneous. Column j was taken j * skew frame periods after column 0, frames follow each
/// other evenly; each column is interpolated (cubic, four frames) to the middle column's time. Loses the first and last two
/// frames.
std::vector<Mat3<double>> deskewed(const std::vector<Mat3<double>>& frames, double skew);

/// A sensor resting on a node of a printed grid, in any attitude.
struct GridFrame {
    Vec3<double> node;  // column, row, level: whole steps
    Mat3<double> x;
    std::size_t line = 0;
};

/// CSV with the header column,row,level,x11,...,x33. Throws InputError, naming file and line.
std::vector<GridFrame> read_grid(const std::string& path);

}  // namespace tricoil::host

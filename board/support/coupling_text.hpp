// Couplings in text files.
#pragma once

#include <span>
#include <string_view>

#include "board/support/text_table.hpp"
#include "core/geometry/types.hpp"

namespace tricoil::host {

/// Header of a CSV file of couplings at known poses; xij: sensor coil i, source coil j.
constexpr std::string_view kPoseCsvHeader = "x_m,y_m,z_m,qw,qx,qy,qz,x11,x12,x13,x21,x22,x23,x31,x32,x33";

/// Nine fields x(i, j), sensor coil i, source coil j, row by row. Throws InputError, naming the place, for a field that is not a
/// finite number and for couplings of rank below three.
Mat3<double> parse_couplings(std::span<const std::string_view> fields, const TextPlace& place);

}  // namespace tricoil::host

// Reads couplings of text files.
#pragma once

#include <span>
#include <string_view>

#include "board/support/text_table.hpp"
#include "core/geometry/types.hpp"

namespace tricoil::host {

/// Nine fields x(i, j), sensor coil i, source coil j, row by row. Throws InputError, naming the place, for a field that is not a
/// finite number and for couplings of rank below three.
Mat3<double> parse_couplings(std::span<const std::string_view> fields, const TextPlace& place);

}  // namespace tricoil::host

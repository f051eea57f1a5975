// Couplings in text files.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "board/support/text_table.hpp"
#include "core/geometry/types.hpp"
#include "core/signal/excitation.hpp"

namespace tricoil::host {

/// Header of a CSV file of couplings at known poses; xij: sensor coil i, source coil j.
constexpr std::string_view kPoseCsvHeader = "x_m,y_m,z_m,qw,qx,qy,qz,x11,x12,x13,x21,x22,x23,x31,x32,x33";

/// Quadratures of the couplings, which may follow them in a CSV header, in the same order. Begins with a comma.
constexpr std::string_view kQuadratureColumns = ",q11,q12,q13,q21,q22,q23,q31,q32,q33";

/// Nine fields (i, j), row by row: ten digits, separated by commas.
std::string matrix_text(const Mat3<double>& matrix);

/// Couplings of a sensor in an unknown pose.
struct CouplingFrame {
    Mat3<double> x;                                         // in phase
    std::optional<Mat3<double>> quadrature = std::nullopt;  // if the file has it
};

/// Number of fields of the couplings in a line.
constexpr std::size_t coupling_fields(bool has_quadrature) { return (has_quadrature ? 2 : 1) * kCouplings; }

/// Fields (i, j), row by row: nine, or eighteen with the quadratures. Throws InputError, naming the place, for a field that is
/// not a finite number.
CouplingFrame parse_couplings(std::span<const std::string_view> fields, const TextPlace& place);

/// Throws InputError, naming the place, for couplings that are zero or have rank below three.
void check_couplings(const CouplingFrame& couplings, const TextPlace& place);

}  // namespace tricoil::host

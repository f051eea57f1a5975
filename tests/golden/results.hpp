// Solves one golden case and prints the results.
#pragma once

#include <cstdint>

#include "hal/console.hpp"

namespace tricoil::golden {

constexpr int kExponent = -13;  // of the mantissas: X = mantissa 2^-13, with C = 1

/// Input: mantissas of X, column by column; then the start pose of the step: range (Q28 metres), direction and O by columns
/// (Q30).
struct Input {
    std::int32_t x[9];
    std::int32_t range;
    std::int32_t direction[3];
    std::int32_t attitude[9];
};

int cases();

/// Prints, per case and solver, four lines "golden CASE SOLVER-ARITHMETIC PART NUMBER...": range and direction, and the columns
/// of the attitude. print_fixed() also prints "tracker-fixed": the last pose of a few blocks of samples, with its flags and
/// shares. Format of float and double: hexadecimal words of their bits. Format of fixed: whole numbers.
Status print_float(int n, hal::Console& console);
Status print_double(int n, hal::Console& console);
Status print_fixed(int n, hal::Console& console);

}  // namespace tricoil::golden

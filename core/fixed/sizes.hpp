// Magnitudes of integers and their limits.
#pragma once

#include <bit>
#include <cstdint>

#include "core/fixed/fixed.hpp"

namespace tricoil::fixed {

constexpr std::int64_t kFullScaleCode = 1 << 23;  // of a 24-bit converter

/// |value|. The result is unsigned, so it is correct for the smallest value too.
constexpr std::uint64_t size_of(std::int64_t value) {
    return value < 0 ? 0U - static_cast<std::uint64_t>(value) : static_cast<std::uint64_t>(value);
}

/// Bit length of `size` minus `bits`; negative if it is shorter.
constexpr int excess_bits(std::uint64_t size, int bits) { return 64 - std::countl_zero(size) - bits; }

/// value 2^-bits for either sign of bits; rounds. The result of an upward shift must fit.
constexpr std::int64_t scaled_down(std::int64_t value, int bits) {
    return bits >= 0 ? shift_right_rounded(value, bits) : value * (std::int64_t{1} << -bits);
}

}  // namespace tricoil::fixed

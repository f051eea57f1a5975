// How large numbers are, and may be.
#pragma once

#include <cstdint>

namespace tricoil::fixed {

constexpr std::int64_t kFullScaleCode = 1 << 23;  // of a 24-bit converter

/// |value|, also of the least number, whose size no signed one holds.
constexpr std::uint64_t size_of(std::int64_t value) {
    return value < 0 ? 0U - static_cast<std::uint64_t>(value) : static_cast<std::uint64_t>(value);
}

}  // namespace tricoil::fixed

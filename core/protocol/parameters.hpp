// Parameters that a tracker board keeps without power: numbers of 32 bits, each set by its own command.
#pragma once

#include <array>
#include <cstdint>

namespace tricoil::protocol {

/// Version of the list. A later one may only append parameters whose default is 0.
constexpr std::uint8_t kParametersVersion = 1;

/// Places in the list. From kHemisphere on a place is not a plain number: hemisphere_argument(), zero: none; characters, the
/// first in the lowest byte, zeros after the end.
enum Parameter : std::uint8_t {
    kNode,
    kBitRate,
    kDataBitRate,
    kStart,
    kMode,
    kConfined,
    kHemisphere,
    kName,
    kParameters = kName + 4
};
constexpr std::size_t kLongestName = 16;
using ParameterValues = std::array<std::uint32_t, kParameters>;
constexpr ParameterValues kDefaultParameters{0, 1'000'000, 5'000'000};

/// Names and ranges of the plain numbers.
constexpr std::array<std::array<const char*, 2>, kHemisphere> kPlainParameters{
    {{"node", "0 to 15"},
     {"bit_rate", "125000, 200000, 250000, 500000 or 1000000"},
     {"data_bit_rate", "2500000 or 5000000"},
     {"start", "0 (idle at power-on), 1 (measures and sends on the serial line) or 2 (on the CAN bus)"},
     {"mode", "a mode of the board, 0 to 15"},
     {"confined", "0, or 1: the sensor never leaves the half space 'hemisphere'"}}};

/// What a device answers about the present values.
enum class ParameterOrigin : std::uint8_t { defaults, saved, damaged, changed };

constexpr bool is_possible(std::size_t place, std::uint32_t value) {
    if (place == kBitRate) {
        return value >= 125'000 && 1'000'000 % value == 0;
    }
    if (place == kDataBitRate) {
        return value >= 2'500'000 && 5'000'000 % value == 0;
    }
    if (place < kHemisphere) {
        return value <= (place == kConfined ? 1U : place == kStart ? 2U : 15U);
    }
    bool is_good = place < kParameters;
    for (unsigned shift = 0; shift < 32; shift += 8) {
        const std::uint32_t byte = value >> shift & 0xFFU;
        const bool is_component = byte != 0x80 && (shift < 24 || byte == 0);
        is_good = is_good && (place == kHemisphere ? is_component : byte == 0 || (byte > ' ' && byte < 0x7F));
    }
    return is_good;
}

}  // namespace tricoil::protocol

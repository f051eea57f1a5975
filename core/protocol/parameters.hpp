// Parameters that a tracker board keeps without power: numbers of 32 bits, each set by its own command.
#pragma once

#include <array>
#include <cstdint>

namespace tricoil::protocol {

/// Version of the list. A later one may only append parameters whose default is 0.
constexpr std::uint8_t kParametersVersion = 1;

/// Places in the list. Hemisphere: hemisphere_argument(), zero: none. Name: characters, the first in the lowest byte.
enum Parameter { kNode, kBitRate, kDataBitRate, kStart, kMode, kConfined, kHemisphere, kName, kParameters = kName + 4 };
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
    constexpr std::array<std::uint32_t, kName> kMost{15, 1'000'000, 5'000'000, 2, 15, 1, 0xFF'FFFF};
    const std::uint32_t parts = place == kBitRate ? 8 : place == kDataBitRate ? 2 : 0;  // of a bit rate
    return place >= kName ||
           (value <= kMost[place] && (parts == 0 || (value >= kMost[place] / parts && kMost[place] % value == 0)));
}

}  // namespace tricoil::protocol

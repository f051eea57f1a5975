// Time unit of the virtual board: a cycle of every clock is a whole number of ticks.
#pragma once

#include <cstdint>
#include <limits>

namespace tricoil::virtual_board {

/// 1/8.16 GHz: 48 ticks per cycle at 170 MHz, 340 at 24 MHz, 510 at 16 MHz, 170 at 48 MHz, 255000 at 32 kHz.
using Ticks = std::int64_t;
constexpr Ticks kTicksPerSecond = 8'160'000'000;
constexpr Ticks kNever = std::numeric_limits<Ticks>::max();

constexpr Ticks ticks(double seconds) { return static_cast<Ticks>(seconds * static_cast<double>(kTicksPerSecond) + 0.5); }
constexpr double seconds(Ticks time) { return static_cast<double>(time) / static_cast<double>(kTicksPerSecond); }

}  // namespace tricoil::virtual_board

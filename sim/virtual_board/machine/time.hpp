// Time unit of the virtual board: fine enough for a cycle of every clock.
#pragma once

#include <cstdint>
#include <limits>

namespace tricoil::virtual_board {

/// 1/2.448 THz: 14400 ticks per cycle at 170 MHz, 16320 at 150 MHz, 153000 at 16 MHz. A cycle of another frequency is rounded to
/// whole ticks, an error of at most 35 ppm, less than that of the chip's oscillators. Times up to 43 days.
using Ticks = std::int64_t;
constexpr Ticks kTicksPerSecond = 2'448'000'000'000;
constexpr Ticks kNever = std::numeric_limits<Ticks>::max();

constexpr Ticks ticks(double seconds) { return static_cast<Ticks>(seconds * static_cast<double>(kTicksPerSecond) + 0.5); }
constexpr double seconds(Ticks time) { return static_cast<double>(time) / static_cast<double>(kTicksPerSecond); }
/// Ticks of one cycle of a clock; 0 for a clock that is off.
constexpr Ticks ticks_of_cycle(double hz) {
    return hz > 0 ? static_cast<Ticks>(static_cast<double>(kTicksPerSecond) / hz + 0.5) : 0;
}

}  // namespace tricoil::virtual_board

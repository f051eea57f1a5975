// How long messages may be on a board.
#pragma once

#include <cstddef>

namespace tricoil::stm32g4 {

/// Longest message that a board sends or takes: one with a calibration blob of 512 bytes has room.
constexpr std::size_t kBoardMessageBytes = 544;

}  // namespace tricoil::stm32g4

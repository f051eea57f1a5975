// Longest message of a board.
#pragma once

#include <cstddef>

namespace tricoil::stm32g4 {

/// Longest message that a board sends or receives: large enough for a calibration blob (597 bytes).
constexpr std::size_t kBoardMessageBytes = 616;

}  // namespace tricoil::stm32g4

// What one straight piece of code holds, read from its bytes: how many instructions, and whether the floating-point unit is used.
#pragma once

#include <cstdint>
#include <span>

namespace tricoil::virtual_board {

struct BlockFacts {
    std::uint32_t bytes = 0;  // 0: not looked at yet
    std::uint16_t instructions = 0;
    std::uint16_t first_float = kNoFloat;  // offset of the first floating-point instruction

    static constexpr std::uint16_t kNoFloat = 0xFFFF;
};

/// Thumb-2: an instruction whose first half-word has its upper five bits at 0b11101 or more is of two half-words (ARMv7-M A5.1).
BlockFacts look_at_block(std::span<const std::uint8_t> code);

}  // namespace tricoil::virtual_board

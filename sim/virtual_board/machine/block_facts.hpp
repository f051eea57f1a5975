// Properties of a basic block, decoded from its bytes: number of instructions, first use of the floating-point unit.
#pragma once

#include <cstdint>
#include <span>

namespace tricoil::virtual_board {

struct BlockFacts {
    std::uint32_t bytes = 0;  // 0: not decoded yet
    std::uint16_t instructions = 0;
    std::uint16_t first_float = kNoFloat;  // offset of the first floating-point instruction

    bool sends_event = false;  // SEV

    static constexpr std::uint16_t kNoFloat = 0xFFFF;
};

/// Thumb-2: an instruction is two half-words long if the upper five bits of the first are 0b11101 or more (ARMv7-M A5.1).
BlockFacts analyse_block(std::span<const std::uint8_t> code);

}  // namespace tricoil::virtual_board

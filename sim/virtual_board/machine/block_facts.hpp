// Properties of a basic block, decoded from its bytes: number of instructions, first use of the floating-point unit.
#pragma once

#include <cstdint>
#include <span>

namespace tricoil::virtual_board {

inline constexpr std::uint32_t kSev = 0xBF40;
/// Coprocessors 10 and 11 are the floating-point unit (ARMv7-M A6.4 to A6.7).
inline bool is_float(std::uint32_t first, std::uint32_t second) {
    return (first & 0xEC00U) == 0xEC00U && (second & 0x0E00U) == 0x0A00U;
}

struct BlockFacts {
    std::uint32_t bytes = 0;  // 0: not decoded yet
    std::uint16_t instructions = 0;
    std::uint16_t first_float = kNoFloat;  // offset of the first floating-point instruction

    bool sends_event = false;  // SEV

    static constexpr std::uint16_t kNoFloat = 0xFFFF;
};

/// Thumb-2: an instruction is two half-words long if the upper five bits of the first are 0b11101 or more (ARMv7-M A5.1).
inline BlockFacts analyse_block(std::span<const std::uint8_t> code) {
    BlockFacts facts;
    facts.bytes = static_cast<std::uint32_t>(code.size());
    const auto half = [&](std::size_t at) { return static_cast<std::uint32_t>(code[at] | code[at + 1] << 8U); };
    for (std::size_t at = 0; at + 2 <= code.size();) {
        const bool is_long = half(at) >> 11U >= 0x1DU && at + 4 <= code.size();
        if (is_long && facts.first_float == BlockFacts::kNoFloat && is_float(half(at), half(at + 2))) {
            facts.first_float = static_cast<std::uint16_t>(at);
        }
        facts.sends_event = facts.sends_event || half(at) == kSev;
        ++facts.instructions;
        at += is_long ? 4 : 2;
    }
    return facts;
}

}  // namespace tricoil::virtual_board

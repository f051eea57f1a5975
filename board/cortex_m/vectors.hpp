// The table that the processor starts from (ARMv7-M B1.5.3).
#pragma once

#include <cstddef>
#include <cstdint>

#include "board/cortex_m/reset.hpp"

extern "C" std::uint32_t stack_top[];  // NOLINT(readability-identifier-naming): name of the linker script

namespace tricoil::board {

using Handler = void (*)();

/// A board defines one, in section ".vectors". The exceptions begin with number 1, reset; the interrupts with number 0.
template <std::size_t interrupt_count>
struct Vectors {
    std::uint32_t* stack;
    Handler exceptions[15];
    Handler interrupts[interrupt_count];

    constexpr Handler& nmi() { return exceptions[1]; }
    constexpr Handler& tick() { return exceptions[14]; }
};

/// Whatever comes but reset is unexpected.
template <std::size_t interrupt_count>
consteval Vectors<interrupt_count> make_vectors(Handler unexpected) {
    Vectors<interrupt_count> vectors{};
    vectors.stack = stack_top;
    for (Handler& handler : vectors.exceptions) {
        handler = unexpected;
    }
    vectors.exceptions[0] = reset_handler;
    for (Handler& handler : vectors.interrupts) {
        handler = unexpected;
    }
    return vectors;
}

}  // namespace tricoil::board

// Vector table (ARMv7-M B1.5.3).
#pragma once

#include <cstddef>
#include <cstdint>

#include "board/cortex_m/reset.hpp"

extern "C" std::uint32_t stack_top[];  // NOLINT(readability-identifier-naming): name of the linker script

namespace tricoil::board {

using Handler = void (*)();

/// A board defines one table in section ".vectors". Exceptions start with number 1, reset; interrupts start with number 0.
template <std::size_t interrupt_count>
struct Vectors {
    std::uint32_t* stack;
    Handler exceptions[15];
    Handler interrupts[interrupt_count];

    constexpr Handler& nmi() { return exceptions[1]; }
    constexpr Handler& tick() { return exceptions[14]; }
};

/// All vectors except reset point to `unexpected`.
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

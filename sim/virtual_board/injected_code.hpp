// Code near the end of flash bank 1, for faults of the program: VirtualBoard::inject().
#pragma once

#include <cstdint>

#include "sim/virtual_board/machine/memory.hpp"

namespace tricoil::virtual_board {

enum class InjectedCode : std::uint8_t {
    idle,            // endless loop
    bad_access,      // reads an address without memory
    stack_overflow,  // pushes registers without end
    code_in_ram,     // jumps to RAM
};

void put_injected_code(Memory& memory);

[[nodiscard]] std::uint32_t address_of(InjectedCode code);

}  // namespace tricoil::virtual_board

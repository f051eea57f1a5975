// Converts a base address to a reference to registers.
#pragma once

#include <cstdint>

namespace tricoil::stm32g4 {

/// Only composition roots and start-up code use addresses; drivers receive references.
template <typename Registers>
Registers& peripheral(std::uintptr_t base) {
    return *reinterpret_cast<Registers*>(base);  // NOLINT(performance-no-int-to-ptr): fixed address of the peripheral
}

}  // namespace tricoil::stm32g4

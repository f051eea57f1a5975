// From a base address to the registers that lie there.
#pragma once

#include <cstdint>

namespace tricoil::stm32g4 {

/// Only composition roots and start-up code say where something lies; drivers are given references.
template <typename Registers>
Registers& peripheral(std::uintptr_t base) {
    return *reinterpret_cast<Registers*>(base);  // NOLINT(performance-no-int-to-ptr): that is where it is
}

}  // namespace tricoil::stm32g4

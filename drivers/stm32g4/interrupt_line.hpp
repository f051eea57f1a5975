// One interrupt line, for the driver that owns it.
#pragma once

#include "drivers/stm32g4/registers/cortex.hpp"

namespace tricoil::stm32g4 {

/// Lets thread context pass work to an interrupt handler: data that only the handler accesses needs no lock.
class InterruptLine {
public:
    InterruptLine(NvicRegisters& nvic, std::uint8_t number) : nvic_(nvic), number_(number) {}

    /// Makes the interrupt pending; the handler runs at once unless another one of equal or higher priority runs. Any
    /// context.
    void pend() { nvic_.ISPR[number_ / 32U] = 1U << (number_ % 32U); }

    void enable() { nvic_.ISER[number_ / 32U] = 1U << (number_ % 32U); }

    /// Priority 0 (highest) to 15.
    void set_priority(std::uint8_t priority) { nvic_.IPR[number_] = static_cast<std::uint8_t>(priority << 4U); }

private:
    NvicRegisters& nvic_;
    std::uint8_t number_;
};

}  // namespace tricoil::stm32g4

// One interrupt, as the driver that it belongs to sees it.
#pragma once

#include "drivers/stm32g4/registers/nvic.hpp"

namespace tricoil::stm32g4 {

/// Lets thread context hand work to an interrupt handler: what only the handler touches needs no lock.
class InterruptLine {
public:
    InterruptLine(NvicRegisters& nvic, std::uint8_t number) : nvic_(nvic), number_(number) {}

    /// Makes the handler run, now if nothing more urgent does. Any context.
    void pend() { nvic_.ISPR[number_ / 32U] = 1U << (number_ % 32U); }

    void enable() { nvic_.ISER[number_ / 32U] = 1U << (number_ % 32U); }

    /// 0 is the most urgent of 16.
    void set_priority(std::uint8_t priority) { nvic_.IPR[number_] = static_cast<std::uint8_t>(priority << 4U); }

private:
    NvicRegisters& nvic_;
    std::uint8_t number_;
};

}  // namespace tricoil::stm32g4

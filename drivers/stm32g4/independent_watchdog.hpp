// The watchdog that has an oscillator of its own.
#pragma once

#include "drivers/stm32g4/registers/iwdg.hpp"
#include "hal/watchdog.hpp"

namespace tricoil::stm32g4 {

/// 32 kHz within some per cent: a time-out is only about right. At most 32 s. It outlives everything but a reset.
class IndependentWatchdog final : public hal::Watchdog {
public:
    explicit IndependentWatchdog(IwdgRegisters& registers) : registers_(registers) {}

private:
    Status do_start(Microseconds timeout) override;
    void do_feed() override;

    IwdgRegisters& registers_;
    bool is_started_ = false;
};

}  // namespace tricoil::stm32g4

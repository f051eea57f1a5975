// Independent watchdog, with its own oscillator.
#pragma once

#include "drivers/stm32g4/registers/iwdg.hpp"
#include "hal/watchdog.hpp"

namespace tricoil::stm32g4 {

/// The oscillator runs at 32 kHz within some percent, so a time-out is only approximate. Time-out: at most 32 s. Only a reset
/// stops the watchdog.
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

// Device time from a 32-bit timer.
#pragma once

#include <cstdint>

#include "drivers/stm32g4/interrupts_off.hpp"
#include "drivers/stm32g4/registers/tim.hpp"
#include "hal/clock.hpp"

namespace tricoil::stm32g4 {

/// Microseconds since start(). The timer overflows every 71 minutes: now() must be called at least that often.
class TimerClock final : public hal::Clock {
public:
    explicit TimerClock(TimRegisters& timer) : timer_(timer) {}

    /// `timer_hz`: the timer's clock frequency, a multiple of 1 MHz. The timer's bus clock must be on.
    void start(std::uint32_t timer_hz) {
        timer_.CR1 = 0;
        timer_.PSC = timer_hz / 1'000'000 - 1;
        timer_.ARR = 0xFFFF'FFFFU;
        timer_.EGR = tim::EGR_UG;  // the prescaler is loaded only by an update event
        timer_.CR1 = tim::CR1_CEN;
    }

private:
    [[nodiscard]] DeviceTime do_now() const override {
        const InterruptsOff guard;
        const std::uint32_t count = timer_.CNT;
        rounds_ += count < last_count_ ? 1 : 0;
        last_count_ = count;
        return device_time_us(rounds_ << 32 | std::int64_t{count});
    }

    TimRegisters& timer_;
    mutable std::uint32_t last_count_ = 0;
    mutable std::int64_t rounds_ = 0;
};

}  // namespace tricoil::stm32g4

// Device time from a 32-bit timer.
#pragma once

#include <cstdint>

#include "drivers/stm32g4/interrupts_off.hpp"
#include "drivers/stm32g4/registers/tim.hpp"
#include "hal/clock.hpp"

namespace tricoil::stm32g4 {

/// Counts microseconds since start(). The timer comes round every 71 minutes: somebody must ask for the time at least that often.
class TimerClock final : public hal::Clock {
public:
    explicit TimerClock(TimRegisters& timer) : timer_(timer) {}

    /// `timer_hz`: what the timer is clocked with, a multiple of 1 MHz. The timer's bus clock is on.
    void start(std::uint32_t timer_hz) {
        timer_.CR1 = 0;
        timer_.PSC = timer_hz / 1'000'000 - 1;
        timer_.ARR = 0xFFFF'FFFFU;
        timer_.EGR = tim::EGR_UG;  // the prescaler takes its value with an update only
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

// Time since the host started the emulated machine.
#pragma once

#include "drivers/semihosting/call.hpp"
#include "hal/clock.hpp"

namespace tricoil::semihosting {

/// The emulator's clock follows the host's time, not the instruction count: suitable for time-outs, not for measurements.
class Clock final : public hal::Clock {
public:
    Clock() {
        const std::int32_t frequency_hz = call(Operation::tick_frequency, nullptr);
        ticks_per_us_ = frequency_hz > 1'000'000 ? frequency_hz / 1'000'000 : 1;
    }

private:
    [[nodiscard]] DeviceTime do_now() const override {
        std::int64_t ticks = 0;
        call(Operation::elapsed, &ticks);
        return device_time_us(ticks / ticks_per_us_);
    }

    std::int64_t ticks_per_us_ = 1;
};

}  // namespace tricoil::semihosting

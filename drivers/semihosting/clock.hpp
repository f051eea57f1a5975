// Time since the host started the emulated machine.
#pragma once

#include "hal/clock.hpp"

namespace tricoil::semihosting {

/// The emulator's clock follows the host's time, not the instruction count: suitable for time-outs, not for measurements.
class Clock final : public hal::Clock {
public:
    Clock();

private:
    [[nodiscard]] DeviceTime do_now() const override;

    std::int64_t ticks_per_us_ = 1;
};

}  // namespace tricoil::semihosting

// Time since the host started the machine.
#pragma once

#include "hal/clock.hpp"

namespace tricoil::semihosting {

/// The emulator's clock runs with the host's, not with the instructions: good for time-outs, not for measuring.
class Clock final : public hal::Clock {
public:
    Clock();

private:
    [[nodiscard]] DeviceTime do_now() const override;

    std::int64_t ticks_per_us_ = 1;
};

}  // namespace tricoil::semihosting

// A clock that advances one microsecond at each reading, so that waits end.
#pragma once

#include "hal/clock.hpp"

namespace tricoil::test {

class SteppingClock final : public hal::Clock {
public:
    void advance(Microseconds time) { now_us_ += time.count(); }

private:
    [[nodiscard]] DeviceTime do_now() const override { return device_time_us(now_us_++); }

    mutable std::int64_t now_us_ = 0;
};

}  // namespace tricoil::test

#include "drivers/semihosting/clock.hpp"

#include "drivers/semihosting/call.hpp"

namespace tricoil::semihosting {

Clock::Clock() {
    const std::int32_t frequency_hz = call(Operation::tick_frequency, nullptr);
    ticks_per_us_ = frequency_hz > 1'000'000 ? frequency_hz / 1'000'000 : 1;
}

DeviceTime Clock::do_now() const {
    std::int64_t ticks = 0;
    call(Operation::elapsed, &ticks);
    return device_time_us(ticks / ticks_per_us_);
}

}  // namespace tricoil::semihosting

// The host's monotonic clock, in microseconds.
#pragma once

#include <ctime>

#include "hal/clock.hpp"

namespace tricoil::drivers {

constexpr std::int64_t to_us(const timespec& time) { return std::int64_t{time.tv_sec} * 1'000'000 + time.tv_nsec / 1000; }

inline std::int64_t clock_us(clockid_t clock) {
    timespec time{};
    clock_gettime(clock, &time);
    return to_us(time);
}

inline std::int64_t monotonic_us() { return clock_us(CLOCK_MONOTONIC); }

class MonotonicClock final : public hal::Clock {
private:
    [[nodiscard]] DeviceTime do_now() const override { return device_time_us(monotonic_us()); }
};

}  // namespace tricoil::drivers

// The host's monotonic clock.
#pragma once

#include <ctime>

#include "core/base/time.hpp"

namespace tricoil::drivers {

constexpr std::int64_t to_us(const timespec& time) { return std::int64_t{time.tv_sec} * 1'000'000 + time.tv_nsec / 1000; }

inline std::int64_t clock_us(clockid_t clock) {
    timespec time{};
    clock_gettime(clock, &time);
    return to_us(time);
}

inline HostTime host_now() { return host_time_us(clock_us(CLOCK_MONOTONIC)); }

}  // namespace tricoil::drivers

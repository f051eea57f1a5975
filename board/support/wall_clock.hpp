// Time in UTC.
#pragma once

#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::host {

struct UtcClock;
/// Instant in UTC, since 1970.
using UtcTime = TimePoint<UtcClock>;

constexpr UtcTime utc_time_us(std::int64_t microseconds) { return UtcTime{Microseconds{microseconds}}; }

inline UtcTime utc_now() { return utc_time_us(drivers::clock_us(CLOCK_REALTIME)); }

/// UTC of an instant of the host's monotonic clock, by the present difference of the two clocks.
inline UtcTime to_utc(HostTime time) { return utc_now() - (drivers::host_now() - time); }

}  // namespace tricoil::host

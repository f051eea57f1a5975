// Time in UTC, in microseconds since 1970.
#pragma once

#include <cstdint>

#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::host {

inline std::int64_t utc_now_us() { return drivers::clock_us(CLOCK_REALTIME); }

/// UTC of an instant of the host's monotonic clock, by the present difference of the two clocks.
inline std::int64_t to_utc_us(HostTime time) { return utc_now_us() - (drivers::host_now() - time).count(); }

}  // namespace tricoil::host

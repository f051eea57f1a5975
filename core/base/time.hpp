// Device time: 64-bit microseconds since the device started, given by the HAL. The core never asks what time it is.
#pragma once

#include <chrono>
#include <cstdint>

namespace tricoil {

using Microseconds = std::chrono::duration<std::int64_t, std::micro>;

/// Tag of the device's time base; it has no now(): instants come from the HAL with every block of samples.
struct DeviceClock {
    using duration = Microseconds;
    using rep = duration::rep;
    using period = duration::period;
    using time_point = std::chrono::time_point<DeviceClock>;
    static constexpr bool is_steady = true;
};

using DeviceTime = DeviceClock::time_point;

constexpr DeviceTime device_time_us(std::int64_t microseconds) { return DeviceTime{Microseconds{microseconds}}; }
constexpr std::int64_t to_us(DeviceTime time) { return time.time_since_epoch().count(); }
constexpr double to_seconds(DeviceTime time) { return 1e-6 * static_cast<double>(to_us(time)); }
constexpr double to_seconds(Microseconds duration) { return 1e-6 * static_cast<double>(duration.count()); }

/// The same in the precision of the caller: a part without double precision in hardware computes no double.
template <typename Scalar>
constexpr Scalar seconds_as(Microseconds duration) {
    return Scalar(1e-6) * static_cast<Scalar>(duration.count());
}

/// Nearest microsecond to `seconds`, which must be finite and within the range of 64-bit microseconds.
constexpr Microseconds microseconds_from_seconds(double seconds) {
    const double us = seconds * 1e6;
    return Microseconds{static_cast<std::int64_t>(us < 0.0 ? us - 0.5 : us + 0.5)};
}

}  // namespace tricoil

// Instants and durations in 64-bit microseconds. The HAL and the drivers supply the time; the core does not read a clock.
#pragma once

#include <compare>
#include <cstdint>
#include <limits>

namespace tricoil {

/// Duration in whole microseconds.
class Microseconds {
public:
    constexpr Microseconds() = default;
    constexpr explicit Microseconds(std::int64_t count) : count_(count) {}

    [[nodiscard]] constexpr std::int64_t count() const { return count_; }
    static constexpr Microseconds max() { return Microseconds{std::numeric_limits<std::int64_t>::max()}; }

    constexpr Microseconds& operator+=(Microseconds other) {
        count_ += other.count_;
        return *this;
    }
    constexpr Microseconds& operator-=(Microseconds other) {
        count_ -= other.count_;
        return *this;
    }
    friend constexpr Microseconds operator-(Microseconds a) { return Microseconds{-a.count_}; }
    friend constexpr Microseconds operator+(Microseconds a, Microseconds b) { return a += b; }
    friend constexpr Microseconds operator-(Microseconds a, Microseconds b) { return a -= b; }
    friend constexpr Microseconds operator*(Microseconds a, std::int64_t factor) { return Microseconds{a.count_ * factor}; }
    friend constexpr Microseconds operator*(std::int64_t factor, Microseconds a) { return a * factor; }
    friend constexpr Microseconds operator/(Microseconds a, std::int64_t divisor) { return Microseconds{a.count_ / divisor}; }
    friend constexpr std::int64_t operator/(Microseconds a, Microseconds b) { return a.count_ / b.count_; }
    friend constexpr Microseconds operator%(Microseconds a, Microseconds b) { return Microseconds{a.count_ % b.count_}; }
    // NOLINTNEXTLINE(modernize-use-nullptr): misread by clang-tidy 14
    friend constexpr auto operator<=>(Microseconds, Microseconds) = default;

private:
    std::int64_t count_ = 0;
};

/// Instant of the clock `Clock`. Instants of different clocks are different types.
template <typename Clock>
class TimePoint {
public:
    constexpr TimePoint() = default;
    constexpr explicit TimePoint(Microseconds since_start) : since_start_(since_start) {}

    [[nodiscard]] constexpr Microseconds since_start() const { return since_start_; }
    static constexpr TimePoint max() { return TimePoint{Microseconds::max()}; }

    constexpr TimePoint& operator+=(Microseconds duration) {
        since_start_ += duration;
        return *this;
    }
    constexpr TimePoint& operator-=(Microseconds duration) {
        since_start_ -= duration;
        return *this;
    }
    friend constexpr TimePoint operator+(TimePoint time, Microseconds duration) { return time += duration; }
    friend constexpr TimePoint operator+(Microseconds duration, TimePoint time) { return time += duration; }
    friend constexpr TimePoint operator-(TimePoint time, Microseconds duration) { return time -= duration; }
    friend constexpr Microseconds operator-(TimePoint a, TimePoint b) { return a.since_start_ - b.since_start_; }
    // NOLINTNEXTLINE(modernize-use-nullptr): misread by clang-tidy 14
    friend constexpr auto operator<=>(TimePoint, TimePoint) = default;

private:
    Microseconds since_start_;
};

struct DeviceClock;
struct HostClock;
/// Instant of the device's clock, counted from the start of the device.
using DeviceTime = TimePoint<DeviceClock>;
/// Instant of the host's monotonic clock.
using HostTime = TimePoint<HostClock>;

constexpr DeviceTime device_time_us(std::int64_t microseconds) { return DeviceTime{Microseconds{microseconds}}; }
constexpr HostTime host_time_us(std::int64_t microseconds) { return HostTime{Microseconds{microseconds}}; }
template <typename Clock>
constexpr std::int64_t to_us(TimePoint<Clock> time) {
    return time.since_start().count();
}
template <typename Clock>
constexpr double to_seconds(TimePoint<Clock> time) {
    return 1e-6 * static_cast<double>(to_us(time));
}
constexpr double to_seconds(Microseconds duration) { return 1e-6 * static_cast<double>(duration.count()); }

/// Duration in seconds in the caller's precision: processors without a double-precision FPU avoid double.
template <typename Scalar>
constexpr Scalar seconds_as(Microseconds duration) {
    const std::int64_t us = duration.count();
    const auto short_us = static_cast<std::int32_t>(us);  // 36 minutes; its conversion is one instruction
    return Scalar(1e-6) * (short_us == us ? static_cast<Scalar>(short_us) : static_cast<Scalar>(us));
}

/// Nearest microsecond to `seconds`, which must be finite and within the range of 64-bit microseconds.
constexpr Microseconds microseconds_from_seconds(double seconds) {
    const double us = seconds * 1e6;
    return Microseconds{static_cast<std::int64_t>(us < 0.0 ? us - 0.5 : us + 0.5)};
}

}  // namespace tricoil

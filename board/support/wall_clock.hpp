// The device's time on the clock on the wall.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>

#include "core/base/time.hpp"

namespace tricoil::host {

/// Poses are late by what their way takes, never early: the least difference of arrival and time that was seen lately maps one
/// clock onto the other. Too late by the shortest way there is (half a window, a transfer), and by at most 2 ms more where the
/// clocks drift apart by 100 ppm.
class WallClock {
public:
    /// lead_us: how long after its own time a pose can be there at the earliest (half a window).
    explicit WallClock(std::int64_t lead_us = 0) : lead_us_(lead_us) {}

    /// Takes note of a pose of `time` that arrived at arrival_us (UTC), and gives its own time in UTC.
    std::int64_t utc_us(DeviceTime time, std::int64_t arrival_us) {
        const std::int64_t difference = arrival_us - to_us(time) - lead_us_;
        const bool jumped = std::abs(difference - std::min(least_, least_before_)) > kLongestDelayUs;
        if (jumped || arrival_us - began_us_ > kEpochUs || arrival_us < began_us_) {
            least_before_ = jumped ? difference : least_;  // the device began anew, or one of the clocks was set
            least_ = difference;
            began_us_ = arrival_us;
        }
        least_ = std::min(least_, difference);
        return to_us(time) + std::min(least_, least_before_);
    }

    static std::int64_t now_us() {
        return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch()).count();
    }

private:
    static constexpr std::int64_t kEpochUs = 10'000'000;
    static constexpr std::int64_t kLongestDelayUs = 1'000'000;
    static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max() / 4;

    std::int64_t lead_us_;
    std::int64_t least_ = kNever;
    std::int64_t least_before_ = kNever;
    std::int64_t began_us_ = 0;
};

}  // namespace tricoil::host

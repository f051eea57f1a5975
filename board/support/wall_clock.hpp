// Converts device time to UTC.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>

#include "core/base/time.hpp"

namespace tricoil::host {

/// A pose arrives after its own time, never before. The smallest recent difference between arrival and pose time therefore maps
/// one clock to the other. The result is late by the shortest delay (half a window, one transfer), and by at most 2 ms more if
/// the clocks drift by 100 ppm.
class WallClock {
public:
    /// lead_us: shortest possible delay of a pose after its own time (half a window).
    explicit WallClock(std::int64_t lead_us = 0) : lead_us_(lead_us) {}

    /// Records that a pose of `time` arrived at arrival_us (UTC). Returns the pose time in UTC.
    std::int64_t utc_us(DeviceTime time, std::int64_t arrival_us) {
        const std::int64_t difference = arrival_us - to_us(time) - lead_us_;
        const bool jumped = std::abs(difference - std::min(least_, least_before_)) > kLongestDelayUs;
        if (jumped || arrival_us - began_us_ > kEpochUs || arrival_us < began_us_) {
            least_before_ = jumped ? difference : least_;  // the device restarted, or a clock was set
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

// Device time that goes on when the device has started again, and jumps of its clock.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <optional>

#include "core/tracking/front/time_base.hpp"

namespace tricoil::linux_board {

/// A clock that ran on while the link was lost stays as it is. One that has started again goes on from the newest time, by the
/// host's time since then.
class ContinuedClock {
public:
    enum class Verdict : std::uint8_t { good, implausible, jumped };

    /// The next time is the first one of a session: measured after the start, and therefore after all earlier times.
    void begin_session() {
        is_first_ = true;
        implausible_ = 0;
    }

    /// Judges the time of a message that arrived at `arrival`. good: moves it. jumped: kJumped times in a row were implausible;
    /// the device must start again. is_late: the time may be before the newest.
    Verdict take(std::int64_t& time_us, HostTime arrival, bool is_late) {
        if (std::abs(time_us) > kLatest_us) {
            return Verdict::implausible;
        }
        const std::int64_t passed_us = std::max<std::int64_t>((arrival - arrival_).count(), 1);
        const std::int64_t ahead_us = time_us + offset_us_ - newest_us_.value_or(time_us - 1);
        if (is_first_ && ahead_us <= 0) {
            offset_us_ += passed_us - ahead_us;
        } else if (!is_first_ && ((ahead_us < -kBack_us && !is_late) || ahead_us - passed_us > kAhead_us)) {
            return ++implausible_ < kJumped ? Verdict::implausible : Verdict::jumped;
        }
        time_us += offset_us_;
        if (time_us > kLatest_us) {
            return Verdict::implausible;
        }
        is_first_ = false;
        implausible_ = 0;
        newest_us_ = std::max(newest_us_.value_or(time_us), time_us);
        arrival_ = arrival;
        return Verdict::good;
    }

private:
    static constexpr std::int64_t kBack_us = 100'000;     // more than between the sensors of a device
    static constexpr std::int64_t kAhead_us = 1'000'000;  // longest delay of a message, as ClockMap
    static constexpr int kJumped = 8;                     // 11 ms of TDM at 240 Hz
    static constexpr std::int64_t kLatest_us = to_us(tracking::TimeBase::kLatest);

    bool is_first_ = true;
    int implausible_ = 0;
    std::int64_t offset_us_ = 0;
    std::optional<std::int64_t> newest_us_;
    HostTime arrival_;  // of the newest good time
};

}  // namespace tricoil::linux_board

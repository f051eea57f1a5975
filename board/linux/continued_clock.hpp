// Device time and sequence numbers that go on when the device has restarted.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "core/base/time.hpp"

namespace tricoil::linux_board {

/// A device that restarts counts from zero again. If its time went back between two sessions, the host's clock shows how much
/// passed.
class ContinuedClock {
public:
    /// The next message is the first one of a session.
    void begin_session() { is_first_ = true; }

    /// Adds to time and sequence what earlier sessions of the device had. A clock that did not go back is left as it is.
    void advance(std::int64_t& time_us, std::uint32_t& sequence, HostTime arrival) {
        if (std::exchange(is_first_, false) && has_newest_) {
            const std::int64_t passed_us = std::max<std::int64_t>((arrival - arrival_).count(), 1);
            const std::int64_t ahead_us = time_us + time_offset_us_ - newest_us_;
            time_offset_us_ += ahead_us > 0 ? 0 : passed_us - ahead_us;
            sequence_offset_ =
                sequence + sequence_offset_ > newest_sequence_ ? sequence_offset_ : newest_sequence_ + 1 - sequence;
        }
        time_us += time_offset_us_;
        sequence += sequence_offset_;
        newest_us_ = has_newest_ ? std::max(newest_us_, time_us) : time_us;
        newest_sequence_ = sequence;
        has_newest_ = true;
        arrival_ = arrival;
    }

private:
    bool is_first_ = false;
    bool has_newest_ = false;
    std::int64_t time_offset_us_ = 0;
    std::int64_t newest_us_ = 0;
    std::uint32_t sequence_offset_ = 0;
    std::uint32_t newest_sequence_ = 0;
    HostTime arrival_;
};

}  // namespace tricoil::linux_board

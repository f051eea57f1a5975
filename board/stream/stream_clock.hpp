// Time that passed in a stream whose clock may start again.
#pragma once

#include <optional>

#include "core/base/time.hpp"

namespace tricoil::host {

class StreamClock {
public:
    static constexpr Microseconds kLongestGap{1'000'000};

    /// A step back by more than kLongestGap, or forward by more than `longest_gap`, is a clock that started again.
    explicit StreamClock(Microseconds longest_gap = kLongestGap) : longest_gap_(longest_gap) {}

    /// Call it with each stamp. Those of several sensors may go back by a little. Single stamps that are far back are ignored: of
    /// a sensor that is silent, or has another clock.
    void follow(DeviceTime now) {
        const Microseconds step = now - newest_.value_or(now);
        far_back_ = step < -kLongestGap ? far_back_ + 1 : 0;
        const bool is_restart = step > longest_gap_ || far_back_ >= kAgreeing;
        elapsed_ += is_restart || step.count() < 0 ? Microseconds{} : step;
        newest_ = is_restart || step.count() >= 0 ? now : *newest_;
        far_back_ = is_restart ? 0 : far_back_;
    }

    /// The clock starts again with the next stamp.
    void restart() {
        newest_.reset();
        far_back_ = 0;
    }

    /// Newest stamp since the clock started; empty: none yet.
    [[nodiscard]] const std::optional<DeviceTime>& newest() const { return newest_; }
    /// Summed over restarts, without their gaps.
    [[nodiscard]] Microseconds elapsed() const { return elapsed_; }

private:
    static constexpr int kAgreeing = 4;  // stamps in a row: more than there are sensors beside one

    Microseconds longest_gap_;
    int far_back_ = 0;  // stamps in a row
    std::optional<DeviceTime> newest_;
    Microseconds elapsed_;
};

}  // namespace tricoil::host

// Button of the stylus: pressed and released by clients and input lines, read by FASTRAK sessions.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>

#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::host {

class StylusButton {
public:
    /// Duration of a click. Longer than the interval between two records, shorter than the repetition of a FASTRAK.
    static constexpr Microseconds kClick{200'000};

    struct State {
        bool down = false;
        std::uint32_t presses = 0;  // since the start
        HostTime time;              // of this state
    };

    /// `notify` is called after each change. It must not wait.
    explicit StylusButton(std::function<void()> notify = {}) : notify_(std::move(notify)) {}

    /// Presses and holds, or releases.
    void set(bool down) { change(down, down ? kForever : drivers::host_now()); }
    /// Presses for the time of a click.
    void click() { change(true, drivers::host_now() + kClick); }

    [[nodiscard]] State state() const {
        const HostTime now = drivers::host_now();
        const std::lock_guard lock(mutex_);
        return {now < down_until_, presses_, now};
    }

private:
    static constexpr HostTime kForever = host_time_us(std::int64_t{1} << 62);

    void change(bool down, HostTime until) {
        {
            const std::lock_guard lock(mutex_);
            presses_ += down && drivers::host_now() >= down_until_ ? 1U : 0U;
            down_until_ = until;
        }
        if (notify_) {
            notify_();
        }
    }

    mutable std::mutex mutex_;
    HostTime down_until_{};
    std::uint32_t presses_ = 0;
    std::function<void()> notify_;
};

}  // namespace tricoil::host

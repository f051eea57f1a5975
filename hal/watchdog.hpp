// Resets the processor when the program hangs.
#pragma once

#include "core/base/status.hpp"
#include "core/base/time.hpp"

namespace tricoil::hal {

/// Once started it cannot be stopped but by a reset, and the reset takes the current from the coils.
class Watchdog {
public:
    Watchdog() = default;
    Watchdog(const Watchdog&) = delete;
    Watchdog& operator=(const Watchdog&) = delete;
    virtual ~Watchdog() = default;

    /// The processor is reset unless feed() comes at least every `timeout`. Thread context.
    /// ok; invalid_argument: longer or shorter than it can measure; timed_out: it does not start.
    Status start(Microseconds timeout) { return do_start(timeout); }

    /// Only from the loop that it is to vouch for, never from an interrupt. Cannot fail; nothing before start().
    void feed() { do_feed(); }

private:
    virtual Status do_start(Microseconds timeout) = 0;
    virtual void do_feed() = 0;
};

}  // namespace tricoil::hal

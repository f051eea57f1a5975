// Resets the processor when the program hangs.
#pragma once

#include "core/base/interface.hpp"
#include "core/base/status.hpp"
#include "core/base/time.hpp"

namespace tricoil::hal {

/// After start() only a reset stops it. The reset removes the current from the coils.
class Watchdog : public Interface {
public:
    /// Resets the processor unless feed() is called at least once per `timeout`. Thread context. ok; invalid_argument: the
    /// timeout is outside the watchdog's range; timed_out: the watchdog does not start.
    Status start(Microseconds timeout) { return do_start(timeout); }

    /// Call it only from the loop that it supervises, never from an interrupt. Cannot fail; has no effect before start().
    void feed() { do_feed(); }

private:
    virtual Status do_start(Microseconds timeout) = 0;
    virtual void do_feed() = 0;
};

}  // namespace tricoil::hal

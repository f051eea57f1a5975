// The source coils' power stages.
#pragma once

#include "core/base/status.hpp"
#include "core/signal/excitation.hpp"

namespace tricoil::hal {

/// Drives the excitation states S1-S3, all, or off.
/// Contract: the coils are off after construction, after any excite() that did not return ok, and after destruction.
class CoilDriver {
public:
    CoilDriver() = default;
    CoilDriver(const CoilDriver&) = delete;
    CoilDriver& operator=(const CoilDriver&) = delete;
    virtual ~CoilDriver() = default;

    /// Changes the state from the next block of samples on; the old coil is off before the new one is on.
    /// Thread context, never an interrupt; does not wait for the current to settle.
    /// ok; invalid_argument: a state that this board cannot drive; not_ready: the power stages have switched off by themselves,
    /// for too much current, until sampling starts anew; device_lost or timed_out: the hardware did not follow.
    Status excite(Excitation state) {
        const Status status = do_excite(state);
        if (!status.ok()) {
            do_switch_off();
        }
        return status;
    }

    /// Takes the current from all coils. Any context; cannot fail: it must not depend on anything that can.
    void switch_off() { do_switch_off(); }

private:
    virtual Status do_excite(Excitation state) = 0;
    virtual void do_switch_off() = 0;
};

}  // namespace tricoil::hal

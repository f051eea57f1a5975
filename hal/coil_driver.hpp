// Power stages of the source coils.
#pragma once

#include "core/base/interface.hpp"
#include "core/base/status.hpp"
#include "core/signal/excitation.hpp"

namespace tricoil::hal {

/// Drives one excitation state: S1-S3, all, or off. Contract: the coils are off after construction, after any excite() that did
/// not return ok, and after destruction.
class CoilDriver : public Interface {
public:
    /// Changes the excitation state, effective from the next sample block. The old coil goes off before the new one goes on.
    /// Thread context, never an interrupt; does not wait for the current to settle. ok; invalid_argument: this board cannot drive
    /// that state; over_current: the power stages have shut down because of over-current, until sampling is started again;
    /// device_lost or timed_out: the hardware did not follow.
    Status excite(Excitation state) {
        const Status status = do_excite(state);
        if (!status.ok()) {
            do_switch_off();
        }
        return status;
    }

    /// Removes the current from all coils. Any context. Cannot fail: an implementation must not depend on anything that can fail.
    void switch_off() { do_switch_off(); }

private:
    virtual Status do_excite(Excitation state) = 0;
    virtual void do_switch_off() = 0;
};

}  // namespace tricoil::hal

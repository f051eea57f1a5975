// The processor: reset reason, health, idle and restart.
#pragma once

#include <cstdint>

#include "core/base/flag_set.hpp"
#include "core/base/interface.hpp"
#include "hal/system_report.hpp"

namespace tricoil::hal {

enum class ResetReason : std::uint8_t {
    power_on,  // or brown-out
    external,  // reset pin
    software,  // requested by the program
    watchdog,  // the program hung
    fault,     // a processor fault or a failed assertion, recorded across the reset
};

/// Processor problems (bit numbers).
enum class SystemFault : std::uint8_t {
    clock,   // the crystal did not start or has stopped: all rates differ from the nominal ones
    stack,   // almost no stack is left
    memory,  // program or data memory is damaged
};
using SystemFaults = FlagSet<SystemFault>;

class SystemControl : public Interface {
public:
    [[nodiscard]] ResetReason reset_reason() const { return do_reset_reason(); }

    /// Present state; polled many times a second. Thread context.
    [[nodiscard]] SystemFaults faults() const { return do_faults(); }

    /// Does not change after boot.
    [[nodiscard]] const SystemReport& report() const { return do_report(); }

    /// Sleeps until an interrupt, at most one millisecond, when a board has nothing to do. Thread context.
    void idle() { do_idle(); }

    /// Resets into the manufacturer's boot loader for a firmware update. No watchdog runs in the loader. The caller has switched
    /// the coils off. Does not return on a processor; a simulation counts the call.
    void restart_into_loader() { do_restart_into_loader(); }

private:
    [[nodiscard]] virtual ResetReason do_reset_reason() const = 0;
    [[nodiscard]] virtual SystemFaults do_faults() const = 0;
    [[nodiscard]] virtual const SystemReport& do_report() const = 0;
    virtual void do_idle() = 0;
    virtual void do_restart_into_loader() = 0;
};

}  // namespace tricoil::hal

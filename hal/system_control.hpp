// The processor itself: why it began, how it is, and how it begins again.
#pragma once

#include <cstdint>

#include "core/base/flag_set.hpp"

namespace tricoil::hal {

enum class ResetReason : std::uint8_t {
    power_on,  // or brown-out
    external,  // reset pin
    software,  // asked for by restart()
    watchdog,  // the program hung
    fault,     // the program did what it must not: a hard fault, told across the reset
};

/// What is wrong with the processor (bit numbers).
enum class SystemTrouble : std::uint8_t {
    clock,   // the crystal did not start or has stopped: rates are not what they say
    stack,   // next to nothing of the stack is left
    memory,  // a memory that should hold the program or its data is damaged
};
using SystemTroubles = FlagSet<SystemTrouble>;

class SystemControl {
public:
    SystemControl() = default;
    SystemControl(const SystemControl&) = delete;
    SystemControl& operator=(const SystemControl&) = delete;
    virtual ~SystemControl() = default;

    [[nodiscard]] ResetReason reset_reason() const { return do_reset_reason(); }

    /// As of now; asked many times a second. Thread context.
    [[nodiscard]] SystemTroubles troubles() const { return do_troubles(); }

    /// Sleeps until an interrupt, a millisecond at most: what a board does that has nothing to do. Thread context.
    void idle() { do_idle(); }

    /// Begins again from reset, coils off. Does not return on a processor; a simulation takes note of it.
    void restart() { do_restart(); }

    /// The same into the manufacturer's loader, by which new firmware comes: before the watchdog is started, as that outlives a
    /// jump. The caller has switched the coils off.
    void restart_into_loader() { do_restart_into_loader(); }

private:
    [[nodiscard]] virtual ResetReason do_reset_reason() const = 0;
    [[nodiscard]] virtual SystemTroubles do_troubles() const = 0;
    virtual void do_idle() = 0;
    virtual void do_restart() = 0;
    virtual void do_restart_into_loader() = 0;
};

}  // namespace tricoil::hal

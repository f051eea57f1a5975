// Proof of life for a hardware enable that drops out by itself.
#pragma once

#include "core/base/status.hpp"

namespace tricoil::hal {

/// The power stages' enable is held by a retriggerable monostable: it stays on only while beat() keeps coming. A program that
/// hangs or is killed leaves no coil on.
class Heartbeat {
public:
    Heartbeat() = default;
    Heartbeat(const Heartbeat&) = delete;
    Heartbeat& operator=(const Heartbeat&) = delete;
    virtual ~Heartbeat() = default;

    /// One edge to the monostable; call it at least every third of its time, and only from the loop that it is to vouch for.
    /// ok; device_lost: the line is gone; the coils will be off.
    Status beat() { return do_beat(); }

private:
    virtual Status do_beat() = 0;
};

}  // namespace tricoil::hal

// Heartbeat line for the hardware enable of the power stages.
#pragma once

#include "core/base/interface.hpp"
#include "core/base/status.hpp"

namespace tricoil::hal {

/// A retriggerable monostable enables the power stages only while beat() is called often enough. When a program hangs or is
/// killed, all coils go off.
class Heartbeat : public Interface {
public:
    /// Sends one edge to the monostable. Call it at least once per third of the monostable's time, and only from the loop that it
    /// supervises. ok; device_lost: the line is gone and the coils will go off.
    Status beat() { return do_beat(); }

private:
    virtual Status do_beat() = 0;
};

}  // namespace tricoil::hal

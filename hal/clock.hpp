// Device time.
#pragma once

#include "core/base/interface.hpp"
#include "core/base/time.hpp"

namespace tricoil::hal {

/// A monotonic clock in the device's time base. Sample blocks carry timestamps of this clock.
class Clock : public Interface {
public:
    /// Any context, interrupts included; never decreases.
    [[nodiscard]] DeviceTime now() const { return do_now(); }

private:
    [[nodiscard]] virtual DeviceTime do_now() const = 0;
};

}  // namespace tricoil::hal

// Button of a device.
#pragma once

#include "core/base/interface.hpp"

namespace tricoil::hal {

class PushButton : public Interface {
public:
    /// Present level of the contact, without debouncing. Any context; cannot fail.
    [[nodiscard]] bool is_pressed() const { return do_is_pressed(); }

private:
    [[nodiscard]] virtual bool do_is_pressed() const = 0;
};

}  // namespace tricoil::hal

// Status LED.
#pragma once

#include "core/base/interface.hpp"

namespace tricoil::hal {

class Indicator : public Interface {
public:
    /// Any context; cannot fail.
    void show(bool lit) { do_show(lit); }

private:
    virtual void do_show(bool lit) = 0;
};

}  // namespace tricoil::hal

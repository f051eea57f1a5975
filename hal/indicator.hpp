// Status LED.
#pragma once

namespace tricoil::hal {

class Indicator {
public:
    Indicator() = default;
    Indicator(const Indicator&) = delete;
    Indicator& operator=(const Indicator&) = delete;
    virtual ~Indicator() = default;

    /// Any context; cannot fail.
    void show(bool lit) { do_show(lit); }

private:
    virtual void do_show(bool lit) = 0;
};

}  // namespace tricoil::hal

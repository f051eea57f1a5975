// GPIO pins: pin function and level.
#pragma once

#include "drivers/stm32g4/registers/gpio.hpp"

namespace tricoil::stm32g4 {

/// One pin of a port whose clock is on. After reset the pin is analog and floats.
class Pin {
public:
    Pin(GpioRegisters& port, unsigned number) : port_(port), number_(number) {}

    /// Makes the pin an output that is low from the start.
    void make_output() const {
        set(false);
        set_mode(gpio::MODER_output);
    }
    void make_alternate(std::uint32_t function, bool pulled_up = false) const {
        const unsigned shift = 4 * (number_ % 8);
        volatile std::uint32_t& functions = port_.AFR[number_ / 8];
        functions = (functions & ~(15U << shift)) | function << shift;
        set_field(port_.OSPEEDR, gpio::OSPEEDR_high);
        set_field(port_.PUPDR, pulled_up ? gpio::PUPDR_pull_up : 0);
        set_mode(gpio::MODER_alternate);
    }

    /// Makes the pin an input with pull-down: low if nothing drives it.
    void make_input() const {
        set_field(port_.PUPDR, gpio::PUPDR_pull_down);
        set_mode(gpio::MODER_input);
    }
    [[nodiscard]] bool is_high() const { return (port_.IDR >> number_ & 1U) != 0; }

    /// Any context: a single write that changes no other pin.
    void set(bool high) const { port_.BSRR = 1U << (number_ + (high ? 0U : 16U)); }

private:
    void set_field(volatile std::uint32_t& fields, std::uint32_t value) const {
        fields = (fields & ~(3U << (2 * number_))) | value << (2 * number_);
    }
    void set_mode(std::uint32_t mode) const { set_field(port_.MODER, mode); }

    GpioRegisters& port_;
    unsigned number_;
};

}  // namespace tricoil::stm32g4

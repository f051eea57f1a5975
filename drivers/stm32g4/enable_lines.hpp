// Enable lines of the coils' power stages.
#pragma once

#include <array>
#include <cstdint>

#include "core/signal/excitation.hpp"
#include "drivers/stm32g4/registers/gpio.hpp"

namespace tricoil::stm32g4 {

/// Three pins of one port, active high. Any context.
class EnableLines {
public:
    EnableLines(GpioRegisters& port, std::array<std::uint8_t, kSourceCoils> pins) : port_(port) {
        for (std::size_t n = 0; n < pins.size(); ++n) {
            bits_[n] = 1U << pins[n];
        }
    }

    /// Break before make.
    void set(Excitation state) const {
        const std::uint32_t on = bits_of(state);
        port_.BRR = all() & ~on;
        if (on != 0) {
            port_.BSRR = on;
        }
    }

    void off() const { port_.BRR = all(); }

private:
    [[nodiscard]] std::uint32_t all() const { return bits_[0] | bits_[1] | bits_[2]; }
    [[nodiscard]] std::uint32_t bits_of(Excitation state) const {
        const int coil = coil_index(state);
        return coil >= 0 ? bits_[static_cast<std::size_t>(coil)] : state == Excitation::all ? all() : 0;
    }

    GpioRegisters& port_;
    std::array<std::uint32_t, kSourceCoils> bits_{};
};

}  // namespace tricoil::stm32g4

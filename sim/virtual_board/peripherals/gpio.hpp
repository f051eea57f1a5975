// One GPIO port (RM0440 section 9).
#pragma once

#include <functional>

#include "sim/virtual_board/machine/peripheral.hpp"
#include "sim/virtual_board/peripherals/register_file.hpp"

namespace tricoil::virtual_board {

class Gpio final : public Peripheral {
public:
    /// Ports A and B have different reset values, because some of their pins are debug pins.
    Gpio(std::uint32_t modes, std::uint32_t speeds, std::uint32_t pulls);

    enum class Mode : std::uint8_t { input, output, alternate, analog };
    [[nodiscard]] Mode mode(unsigned pin) const { return static_cast<Mode>(field(registers_[0x00], 2 * pin, 2)); }
    [[nodiscard]] unsigned function(unsigned pin) const { return field(registers_[pin < 8 ? 0x20 : 0x24], 4 * (pin % 8), 4); }
    [[nodiscard]] bool is_alternate(unsigned pin, unsigned f) const { return mode(pin) == Mode::alternate && function(pin) == f; }
    [[nodiscard]] bool is_analog(unsigned pin) const { return mode(pin) == Mode::analog; }
    /// Level of the pin: low unless it is an output that is set, because of the board's pull-downs.
    [[nodiscard]] bool drives_high(unsigned pin) const { return mode(pin) == Mode::output && is_set(registers_[0x14], pin); }

    /// Called after an output may have changed.
    std::function<void()> on_change;

    std::uint32_t read(std::uint32_t offset) override;
    void write(std::uint32_t offset, std::uint32_t value) override;
    void reset() override;

private:
    RegisterFile<11> registers_;
};

}  // namespace tricoil::virtual_board

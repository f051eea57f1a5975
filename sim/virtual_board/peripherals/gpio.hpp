// One GPIO port (RM0440 section 9).
#pragma once

#include <array>
#include <functional>

#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

class Gpio final : public RegisterPeripheral {
public:
    /// Ports A and B have different reset values, because some of their pins are debug pins.
    Gpio(std::uint32_t modes, std::uint32_t speeds, std::uint32_t pulls);

    enum class Mode : std::uint8_t { input, output, alternate, analog };
    [[nodiscard]] Mode mode(unsigned pin) const { return static_cast<Mode>(field(registers_[0x00], 2 * pin, 2)); }
    [[nodiscard]] unsigned function(unsigned pin) const { return field(registers_[pin < 8 ? 0x20 : 0x24], 4 * (pin % 8), 4); }
    [[nodiscard]] bool is_alternate(unsigned pin, unsigned f) const { return mode(pin) == Mode::alternate && function(pin) == f; }
    [[nodiscard]] bool is_analog(unsigned pin) const { return mode(pin) == Mode::analog; }
    /// True if the pin is an output at high level. The board's pull-downs make any other pin low.
    [[nodiscard]] bool drives_high(unsigned pin) const;
    /// Level that IDR shows: of an output, else of the board's circuit, else of the pull resistors.
    [[nodiscard]] bool level(unsigned pin) const;

    /// Level that the board's circuit, for example a button, gives the pin.
    enum class Outside : std::uint8_t { open, low, high };
    void set_outside(unsigned pin, Outside level);
    [[nodiscard]] bool outside_is_high(unsigned pin) const { return outside_[pin] == Outside::high; }

    /// Called after the level of a pin may have changed.
    std::function<void()> on_change = [] {};

    std::uint32_t read(std::uint32_t offset) override;
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override;
    void reset() override;

private:
    void apply(std::uint32_t offset, std::uint32_t value) override;
    void lock(std::uint32_t value);
    void check_lock(std::uint32_t offset, std::uint32_t value) const;
    [[nodiscard]] bool floats(unsigned pin) const;

    std::array<Outside, 16> outside_{};
    std::uint32_t locked_ = 0;
    std::uint32_t lock_written_ = 0;  // last value of LCKR
    unsigned lock_step_ = 0;          // of the lock key sequence
};

}  // namespace tricoil::virtual_board

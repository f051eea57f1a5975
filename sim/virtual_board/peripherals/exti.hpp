// Extended interrupts and events (RM0440 section 15): lines 0 to 15 of the pins, and software triggers.
#pragma once

#include <functional>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

class Exti final : public RegisterPeripheral {
public:
    static constexpr unsigned kPinLines = 16;

    explicit Exti(Machine& machine);

    /// True if an edge of a pin has an effect.
    [[nodiscard]] bool is_watching() const { return ((registers_[kRising] | registers_[kFalling]) & 0xFFFFU) != 0; }
    /// Level of the pin that SYSCFG connects to line 0 to 15; set by the board.
    std::function<bool(unsigned line)> level_of;
    /// Call it after the level of a pin may have changed.
    void check_pins();

    void reset() override;

private:
    void apply(std::uint32_t offset, std::uint32_t value) override;
    static constexpr std::uint32_t kRising = 0x08;
    static constexpr std::uint32_t kFalling = 0x0C;
    [[nodiscard]] std::uint32_t levels() const;
    void trigger(std::uint32_t lines);
    void show_interrupts();

    Machine& machine_;
    std::uint32_t levels_ = 0;
};

}  // namespace tricoil::virtual_board

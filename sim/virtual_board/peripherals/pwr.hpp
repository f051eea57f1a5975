// Power control (RM0440 section 6): core voltage and its limits.
#pragma once

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/peripherals/register_file.hpp"

namespace tricoil::virtual_board {

class Pwr final : public Peripheral {
public:
    explicit Pwr(Machine& machine) : settled_(machine.events, [] {}) {}

    /// True after the regulator has settled.
    [[nodiscard]] bool is_boosted() const { return !is_set(registers_[kCr5], 8) && !settled_.is_due(); }
    /// True if the dead-battery pull-downs (USB-C) on PB4 and PB6 are off.
    [[nodiscard]] bool dead_battery_disabled() const { return is_set(registers_[kCr3], 14); }

    std::uint32_t read(std::uint32_t offset) override {
        return registers_.at(offset) | flag(offset == kSr2 && settled_.is_due(), kVoltageChanges);
    }
    void write(std::uint32_t offset, std::uint32_t value) override {
        if (offset == kCr5 && is_set(value, 8) != is_set(registers_[kCr5], 8)) {
            settled_.in(ticks(kSettleS));
        }
        registers_.at(offset) = value;
    }
    void reset() override {
        registers_.reset();
        settled_.cancel();
    }

private:
    static constexpr std::uint32_t kCr3 = 0x08;
    static constexpr std::uint32_t kSr2 = 0x14;
    static constexpr unsigned kVoltageChanges = 10;
    static constexpr double kSettleS = 20e-6;  // DS12288, time between voltage scalings; maximum
    static constexpr std::uint32_t kCr5 = 0x80;
    RegisterFile<33> registers_{{0x00, 0x200}, {0x04, 0}, {kCr3, 0x8000}, {0x0C, 0},
                                {0x10, 0},     {kSr2, 0}, {0x18, 0},      {kCr5, 0x100}};
    Event settled_;
};

}  // namespace tricoil::virtual_board

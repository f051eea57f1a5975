// Power control (RM0440 section 6): core voltage and its limits, low-power modes, wake-up pins. The supply is always 3.3 V.
#pragma once

#include <functional>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

class Pwr final : public RegisterPeripheral {
public:
    explicit Pwr(Machine& machine);

    /// Frequency limits of the core voltage, `boost` after the regulator has settled.
    enum class Range : std::uint8_t { boost, normal, low, low_power_run };
    [[nodiscard]] Range range() const;
    /// True if the dead-battery pull-downs (USB-C) on PB4 and PB6 are off.
    [[nodiscard]] bool dead_battery_disabled() const { return is_set(registers_[kCr3], 14); }
    [[nodiscard]] bool backup_is_writable() const { return is_set(registers_[kCr1], 8); }

    /// Mode that deep sleep enters.
    enum class DeepSleep : std::uint8_t { stop, standby, shutdown };
    [[nodiscard]] DeepSleep deep_sleep() const;
    /// True if a wake-up pin ends standby at once.
    [[nodiscard]] bool has_wake_up() const { return (status_ & field(registers_[kCr3], 0, kWakePins)) != 0; }
    /// Level of wake-up pin 1 to 5.
    void set_wake_pin(unsigned number, bool high);
    /// Called when a wake-up pin sets its flag.
    std::function<void()> on_wake_pin = [] {};
    /// Throws RunFailure if the core clock is too fast for the new core voltage; set by the board.
    std::function<void()> check_frequency = [] {};
    /// Power-on clears the flags; leaving standby sets SBF.
    void lose_power() { status_ = 0; }
    void set_standby_flag() { status_ |= 1U << kStandbyFlag; }

    std::uint32_t read(std::uint32_t offset) override;
    void reset() override;

private:
    void apply(std::uint32_t offset, std::uint32_t value) override;
    static constexpr std::uint32_t kCr1 = 0x00;
    static constexpr std::uint32_t kCr3 = 0x08;
    static constexpr std::uint32_t kCr5 = 0x80;
    static constexpr unsigned kWakePins = 5;
    static constexpr unsigned kStandbyFlag = 8;

    Event settled_;
    std::uint32_t status_ = 0;  // SR1
    std::uint32_t pins_ = 0;
};

}  // namespace tricoil::virtual_board

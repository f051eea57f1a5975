// Power control (RM0440 section 6): core voltage and its limits, low-power modes, wake-up pins. The supply is always 3.3 V.
#pragma once

#include <functional>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

class Pwr final : public RegisterPeripheral {
public:
    explicit Pwr(Machine& machine)
        : RegisterPeripheral({{kCr1, 0x200, "CR1", 0x4707},
                              {0x04, 0, "CR2", 0x1F, "PVME1@4 PVME2@5 PVME3@6 PVME4@7"},
                              {kCr3, 0x8000, "CR3", 0xE01F, "RRS@8 APC@10"},
                              {kCr4, 0, "CR4", 0x1F, "VBE@8 VBRS@9"},
                              {kSr1, 0, "SR1", kAllBits},
                              {kSr2, 0, "SR2", kAllBits},
                              {kScr, 0, "SCR", kAllBits},
                              {kCr5, 0x100, "CR5", 0x100}}),
          settled_(machine.events, [] {}) {}

    /// Frequency limits of the core voltage, `boost` after the regulator has settled.
    enum class Range : std::uint8_t { boost, normal, low, low_power_run };
    [[nodiscard]] Range range() const {
        if (is_set(registers_[kCr1], kLowPowerRun)) {
            return Range::low_power_run;
        }
        if (field(registers_[kCr1], 9, 2) != 1) {
            return Range::low;
        }
        return !is_set(registers_[kCr5], 8) && !settled_.is_due() ? Range::boost : Range::normal;
    }
    /// True if the dead-battery pull-downs (USB-C) on PB4 and PB6 are off.
    [[nodiscard]] bool dead_battery_disabled() const { return is_set(registers_[kCr3], 14); }
    [[nodiscard]] bool backup_is_writable() const { return is_set(registers_[kCr1], 8); }

    /// Mode that deep sleep enters.
    enum class DeepSleep : std::uint8_t { stop, standby, shutdown };
    [[nodiscard]] DeepSleep deep_sleep() const {
        const std::uint32_t mode = field(registers_[kCr1], 0, 3);
        return mode < 2 ? DeepSleep::stop : mode == 3 ? DeepSleep::standby : DeepSleep::shutdown;
    }
    /// True if a wake-up pin ends standby at once.
    [[nodiscard]] bool has_wake_up() const { return (status_ & field(registers_[kCr3], 0, kWakePins)) != 0; }
    /// Level of wake-up pin 1 to 5.
    void set_wake_pin(unsigned number, bool high) {
        const unsigned bit = number - 1;
        const bool changes = is_set(pins_, bit) != high;
        pins_ = (pins_ & ~(1U << bit)) | flag(high, bit);
        const bool wanted_edge = high != is_set(registers_[kCr4], bit);
        if (changes && wanted_edge && is_set(registers_[kCr3], bit)) {
            status_ |= 1U << bit;
            on_wake_pin();
        }
    }
    /// Called when a wake-up pin sets its flag.
    std::function<void()> on_wake_pin = [] {};
    /// Throws RunFailure if the core clock is too fast for the new core voltage; set by the board.
    std::function<void()> check_frequency = [] {};
    /// Power-on clears the flags; leaving standby sets SBF.
    void lose_power() { status_ = 0; }
    void set_standby_flag() { status_ |= 1U << kStandbyFlag; }

    std::uint32_t read(std::uint32_t offset) override {
        const std::uint32_t regulator =
            flag(settled_.is_due(), kVoltageChanges) | flag(range() == Range::low_power_run, kLowPowerRegulator);
        return offset == kSr1 ? status_ : offset == kSr2 ? regulator : registers_.at(offset);
    }
    void reset() override {
        registers_.reset();
        settled_.cancel();
    }

private:
    static constexpr std::uint32_t kCr4 = 0x0C;
    static constexpr std::uint32_t kSr1 = 0x10;
    static constexpr std::uint32_t kSr2 = 0x14;
    static constexpr std::uint32_t kScr = 0x18;
    static constexpr unsigned kLowPowerRun = 14;
    static constexpr unsigned kLowPowerRegulator = 9;
    static constexpr unsigned kVoltageChanges = 10;
    static constexpr double kSettleS = 20e-6;  // DS12288, time between voltage scalings; maximum
    static constexpr std::uint32_t kFlags = 0x11F;

    void apply(std::uint32_t offset, std::uint32_t value) override {
        if (offset == kScr) {
            status_ &= ~(value & kFlags);
            return;
        }
        const std::uint32_t voltage = field(value, 9, 2);
        fail_if(offset == kCr1 && (voltage == 0 || voltage == 3), "CR1: VOS must be 1 (range 1) or 2 (range 2)");
        const bool changes_voltage = (offset == kCr5 && ((value ^ registers_[kCr5]) & 0x100U) != 0) ||
                                     (offset == kCr1 && ((value ^ registers_[kCr1]) & 0x600U) != 0);
        registers_.at(offset) = value;
        if (changes_voltage) {
            settled_.in(ticks(kSettleS));
        }
        if (offset == kCr1 || offset == kCr5) {
            check_frequency();
        }
    }
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

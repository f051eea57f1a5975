// Window watchdog (RM0440 section 44): clocked by the bus clock.
#pragma once

#include <functional>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

class Wwdg final : public RegisterPeripheral {
public:
    Wwdg(Machine& machine, InterruptLine interrupt, std::function<Ticks()> clock, std::function<void()> on_expired)
        : RegisterPeripheral({{kControl, kTop, "CR", 0xFF}, {kConfiguration, kTop, "CFR", 0x3A7F}, {kStatus, 0, "SR", kAllBits}}),
          machine_(machine),
          interrupt_(interrupt),
          clock_(std::move(clock)),
          on_expired_(std::move(on_expired)),
          step_(machine.events, [this] { count_down(); }) {}

    std::uint32_t read(std::uint32_t offset) override {
        return offset == kControl ? flag(step_.is_due(), 7) | count_ : registers_.at(offset);
    }
    void reset() override {
        registers_.reset();
        step_.cancel();
        count_ = kTop;
        show_interrupt();
    }

private:
    static constexpr std::uint32_t kControl = 0x00;
    static constexpr std::uint32_t kConfiguration = 0x04;
    static constexpr std::uint32_t kStatus = 0x08;
    static constexpr unsigned kEarlyWakeUp = 9;
    static constexpr std::uint32_t kTop = 0x7F;
    static constexpr std::uint32_t kLast = 0x40;  // below it the watchdog resets

    void apply(std::uint32_t offset, std::uint32_t value) override {
        switch (offset) {
            case kControl:
                refresh(value);
                break;
            case kStatus:
                registers_.at(kStatus) &= value;
                break;
            default:
                registers_.at(offset) = value | (registers_[offset] & 1U << kEarlyWakeUp);  // EWI stays until a reset
        }
        show_interrupt();
    }

    [[nodiscard]] Ticks period() const { return clock_() * Ticks{4096} << field(registers_[kConfiguration], 11, 3); }
    void refresh(std::uint32_t value) {
        const bool runs = step_.is_due();
        if (runs && count_ > field(registers_[kConfiguration], 0, 7)) {
            on_expired_();  // outside the window
        }
        count_ = value & kTop;
        if (!runs && is_set(value, 7)) {
            step_.in(period());
        }
        expire_if_below();
    }
    void count_down() {
        count_ = (count_ - 1) & kTop;
        step_.in(period());
        registers_.at(kStatus) |= flag(count_ == kLast, 0);
        show_interrupt();
        expire_if_below();
    }
    void expire_if_below() {
        if (step_.is_due() && count_ < kLast) {
            on_expired_();
        }
    }
    void show_interrupt() {
        machine_.nvic.set_level(interrupt_, is_set(registers_[kStatus], 0) && is_set(registers_[kConfiguration], kEarlyWakeUp));
    }

    Machine& machine_;
    InterruptLine interrupt_;
    std::function<Ticks()> clock_;
    std::function<void()> on_expired_;
    Event step_;
    std::uint32_t count_ = kTop;
};

}  // namespace tricoil::virtual_board

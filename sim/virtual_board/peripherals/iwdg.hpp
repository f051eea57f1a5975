// Independent watchdog (RM0440 section 43) with its window: clocked by the 32 kHz oscillator; cannot be stopped.
#pragma once

#include <algorithm>
#include <array>
#include <functional>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

class Iwdg final : public RegisterPeripheral {
public:
    Iwdg(Machine& machine, std::function<void()> on_expired)
        : RegisterPeripheral({{kKey, 0, "KR", kAllBits},
                              {kPrescaler, 0, "PR", 0x7},
                              {kReload, 0xFFF, "RLR", 0xFFF},
                              {kStatus, 0, "SR", kAllBits},
                              {kWindow, 0xFFF, "WINR", 0xFFF}}),
          events_(machine.events),
          on_expired_(std::move(on_expired)),
          expires_(
              machine.events, [this] { on_expired_(); }, Event::Clock::always),
          updates_{{{machine.events, [] {}, Event::Clock::always},
                    {machine.events, [] {}, Event::Clock::always},
                    {machine.events, [] {}, Event::Clock::always}}} {}

    [[nodiscard]] bool runs() const { return expires_.is_due(); }

    std::uint32_t read(std::uint32_t offset) override {
        return registers_.at(offset) |
               (offset == kStatus ? flag(updates_[0].is_due(), 0) | flag(updates_[1].is_due(), 1) | flag(updates_[2].is_due(), 2)
                                  : 0U);
    }
    void reset() override {
        registers_.reset();
        expires_.cancel();
        std::ranges::for_each(updates_, &Event::cancel);
        unlocked_ = false;
    }

private:
    static constexpr std::uint32_t kKey = 0x00;
    static constexpr std::uint32_t kPrescaler = 0x04;
    static constexpr std::uint32_t kReload = 0x08;
    static constexpr std::uint32_t kStatus = 0x0C;
    static constexpr std::uint32_t kWindow = 0x10;
    static constexpr Ticks kUpdateCycles = 5;  // RM0440, IWDG_SR
    static constexpr Ticks kTicksPerCycle = kTicksPerSecond / 32'000;

    void apply(std::uint32_t offset, std::uint32_t value) override {
        if (offset == kKey) {
            take_key(value);
            return;
        }
        fail_if(!unlocked_, "PR, RLR or WINR is written without the key 0x5555");
        Event& update = updates_[offset == kPrescaler ? 0 : offset == kReload ? 1 : 2];
        fail_if(update.is_due(), "PR, RLR or WINR is written again before its last update has finished");
        update.in(kUpdateCycles * kTicksPerCycle);
        registers_.at(offset) = value;
        if (offset == kWindow && runs()) {  // also reloads the counter
            expires_.in(period());
        }
    }
    [[nodiscard]] Ticks step() const { return (Ticks{4} << std::min(registers_[kPrescaler] & 7U, 6U)) * kTicksPerCycle; }
    [[nodiscard]] Ticks period() const { return (Ticks{registers_[kReload]} + 1) * step(); }
    [[nodiscard]] Ticks count() const { return (expires_.when() - events_.now()) / step(); }

    void take_key(std::uint32_t key) {
        unlocked_ = key == 0x5555;
        if (key == 0xAAAA && runs() && count() > Ticks{registers_[kWindow]}) {
            on_expired_();  // reloaded outside the window
        } else if (key == 0xCCCC || (key == 0xAAAA && runs())) {
            expires_.in(period());
        }
    }

    const Events& events_;
    std::function<void()> on_expired_;
    Event expires_;
    std::array<Event, 3> updates_;  // of PR, RLR, WINR: pending while SR.PVU, RVU, WVU is set
    bool unlocked_ = false;
};

}  // namespace tricoil::virtual_board

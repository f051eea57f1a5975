// Independent watchdog (RM0440 section 43): clocked by the 32 kHz oscillator; cannot be stopped.
#pragma once

#include <functional>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/peripherals/register_file.hpp"

namespace tricoil::virtual_board {

class Iwdg final : public Peripheral {
public:
    Iwdg(Machine& machine, std::function<void()> on_expired)
        : expires_(machine.events, std::move(on_expired)),
          prescaler_(machine.events, [] {}),
          reload_(machine.events, [] {}),
          window_(machine.events, [] {}) {}

    [[nodiscard]] bool runs() const { return expires_.is_due(); }

    std::uint32_t read(std::uint32_t offset) override {
        return registers_.at(offset) |
               (offset == kStatus ? flag(prescaler_.is_due(), 0) | flag(reload_.is_due(), 1) | flag(window_.is_due(), 2) : 0U);
    }
    void write(std::uint32_t offset, std::uint32_t value) override {
        if (offset != kKey) {
            if (!unlocked_) {
                throw RunFailure("PR, RLR or WINR is written without the key 0x5555");
            }
            Event& update = offset == kPrescaler ? prescaler_ : offset == kReload ? reload_ : window_;
            if (update.is_due()) {
                throw RunFailure("PR, RLR or WINR is written again before its last update has finished");
            }
            update.in(kUpdateCycles * kTicksPerCycle);
            registers_.at(offset) = value;
            return;
        }
        unlocked_ = value == 0x5555;
        if (value == 0xCCCC || (value == 0xAAAA && runs())) {
            expires_.in(period());
        }
    }
    void reset() override {
        registers_.reset();
        expires_.cancel();
        prescaler_.cancel();
        reload_.cancel();
        window_.cancel();
        unlocked_ = false;
    }

private:
    static constexpr std::uint32_t kKey = 0x00;
    static constexpr std::uint32_t kPrescaler = 0x04;
    static constexpr std::uint32_t kReload = 0x08;
    static constexpr std::uint32_t kStatus = 0x0C;
    static constexpr Ticks kUpdateCycles = 5;  // RM0440, IWDG_SR
    static constexpr Ticks kTicksPerCycle = kTicksPerSecond / 32'000;
    [[nodiscard]] Ticks period() const {
        return (Ticks{registers_[0x08] & 0xFFFU} + 1) * (Ticks{4} << (registers_[0x04] & 7U)) * kTicksPerCycle;
    }

    RegisterFile<5> registers_{{kKey, 0}, {0x04, 0}, {0x08, 0xFFF}, {0x0C, 0}, {0x10, 0xFFF}};
    Event expires_;
    Event prescaler_;  // SR.PVU is set while it is pending
    Event reload_;     // SR.RVU
    Event window_;     // SR.WVU
    bool unlocked_ = false;
};

}  // namespace tricoil::virtual_board

// Random number generator (RM0440 section 26). Its numbers repeat in each run.
#pragma once

#include <functional>
#include <random>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

class Rng final : public RegisterPeripheral {
public:
    /// `has_clock`: the clock that CCIPR.CLK48SEL selects.
    Rng(Machine& machine, InterruptLine interrupt, std::function<bool()> has_clock)
        : RegisterPeripheral({{kControl, 0, "CR", 0x2C}, {kStatus, 0, "SR", kAllBits}, {kData, 0, "DR", kAllBits}}),
          machine_(machine),
          interrupt_(interrupt),
          has_clock_(std::move(has_clock)),
          ready_(machine.events, [this] { finish(); }) {}

    std::uint32_t read(std::uint32_t offset) override {
        if (offset != kData || !has_number_) {
            return offset == kData ? 0 : offset == kStatus ? flag(has_number_, 0) : registers_.at(offset);
        }
        has_number_ = false;
        show_interrupt();
        start();
        return static_cast<std::uint32_t>(random_());
    }
    void reset() override {
        registers_.reset();
        ready_.cancel();
        has_number_ = false;
        show_interrupt();
    }

private:
    static constexpr std::uint32_t kControl = 0x00;
    static constexpr std::uint32_t kStatus = 0x04;
    static constexpr std::uint32_t kData = 0x08;
    static constexpr double kNumberS = 412.0 / 48e6;  // of four words, RM0440

    void apply(std::uint32_t offset, std::uint32_t value) override {
        if (offset == kData) {
            throw RunFailure("DR is read-only");
        }
        registers_.at(offset) = value;
        start();
        show_interrupt();
    }

    void start() {
        if (!is_set(registers_[kControl], 2)) {
            ready_.cancel();
            has_number_ = false;
        } else if (!has_clock_()) {
            throw RunFailure("the generator is enabled without its clock (RCC CCIPR.CLK48SEL)");
        } else if (!has_number_ && !ready_.is_due()) {
            ready_.in(ticks(kNumberS));
        }
    }
    void finish() {
        has_number_ = true;
        show_interrupt();
    }
    void show_interrupt() { machine_.nvic.set_level(interrupt_, has_number_ && is_set(registers_[kControl], 3)); }

    Machine& machine_;
    InterruptLine interrupt_;
    std::function<bool()> has_clock_;
    Event ready_;
    std::mt19937 random_;
    bool has_number_ = false;
};

}  // namespace tricoil::virtual_board

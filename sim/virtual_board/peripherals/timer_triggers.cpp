// Triggers of other peripherals, and of timers by each other.
#include <utility>

#include "sim/virtual_board/peripherals/timer.hpp"
#include "sim/virtual_board/peripherals/timer_registers.hpp"

namespace tricoil::virtual_board {
namespace {

/// Number of the trigger input: 0 to 3 and from 8 other timers, 4 to 7 pins.
unsigned trigger_input(std::uint32_t smcr) { return field(smcr, 4, 3) | field(smcr, 20, 2) << 3U; }

}  // namespace

void Timer::connect(unsigned input, Timer& master) {
    masters_.at(input) = &master;
    master.on_trigger.emplace_back([this, input] { triggered(input); });
}

/// True if the counter counts pulses of a trigger or edges of an encoder.
bool Timer::waits_for_triggers() const {
    const std::uint32_t smcr = params_.channels > 0 ? registers_[timer::kSmcr] : 0;
    const std::uint32_t mode = field(smcr, 0, 3);
    const Timer* const master = masters_[trigger_input(smcr) % masters_.size()];
    fail_if(mode == timer::gated && (master == nullptr || field(master->registers_[timer::kCr2], 4, 3) != timer::by_update),
            "SMCR: only the update of another timer can be the gate (SMS = 5) in this model");
    return mode != timer::free_running && mode != timer::reset_by_trigger && mode != timer::start_by_trigger;
}

void Timer::trigger(std::uint32_t mode) {
    if (field(registers_[timer::kCr2], 4, 3) == mode) {
        for (const auto& act : on_trigger) {
            act();
        }
    }
}

/// A pulse at a trigger input.
void Timer::triggered(unsigned input) {
    const std::uint32_t smcr = registers_[timer::kSmcr];
    const std::uint32_t mode = field(smcr, 0, 3);
    if (mode <= timer::encoder || trigger_input(smcr) != input) {
        return;
    }
    fail_if(std::exchange(is_triggered_, true), "SMCR: timers that trigger each other without end are not in this model");
    registers_.at(timer::kSr) |= 1U << 6U;  // TIF
    if (mode == timer::reset_by_trigger) {
        generate(1);
    } else if (mode == timer::start_by_trigger && !is_enabled()) {
        control(registers_[timer::kCr1] | 1U);
    } else if (waits_for_triggers() && is_enabled() && divided_++ >= prescaler_) {
        divided_ = 0;
        const bool ends = elapsed() == last();
        stopped_at_ += counts_down() ? -1U : 1U;
        if (ends) {
            overflow();
        }
        settle();
    }
    is_triggered_ = false;
    show_interrupt();
}

}  // namespace tricoil::virtual_board

// Capture inputs, DMA requests and bursts.
#include "sim/virtual_board/peripherals/timer.hpp"
#include "sim/virtual_board/peripherals/timer_registers.hpp"

namespace tricoil::virtual_board {

bool Timer::is_input(unsigned channel) const { return field(registers_[timer::modes(channel)], 8 * (channel % 2), 2) != 0; }

/// The count goes to the channel's register.
void Timer::capture(unsigned channel) {
    const bool unread = is_set(registers_[timer::kSr], channel + 1);
    registers_.at(timer::kSr) |= flag(unread, channel + 9);  // CCxOF
    registers_.at(timer::compare(channel)) = count();
    match(channel);
}

/// Next edge at input 1, if TISEL connects a clock.
void Timer::schedule_capture() {
    const std::uint32_t mode = registers_[timer::kModes];
    const std::uint32_t enables = registers_[timer::kCcer];
    const Ticks cycle = params_.input ? params_.input(registers_[timer::kInputs]) : 0;
    if (field(mode, 0, 2) == 1 && is_set(enables, 0) && cycle > 0) {
        const bool both_edges = (enables & 0xAU) == 0xAU;
        capture_.in((cycle << field(mode, 2, 2)) / (both_edges ? 2 : 1));
    } else {
        capture_.cancel();
    }
}

/// A DMA request of one source (DCR.DBSS), which may be that of a burst.
void Timer::request(unsigned id, std::uint32_t source) {
    const std::uint32_t dcr = params_.channels > 0 ? registers_[timer::kDcr] : 0;
    for (std::uint32_t left = field(dcr, 16, 4) == source ? field(dcr, 8, 5) + 1 : 1; left > 0; --left) {
        (void)dma_.request(id);
    }
}

/// DMAR stands for one register after the other, some of which this timer may not have.
std::uint32_t Timer::next_of_burst() {
    const std::uint32_t dcr = registers_[timer::kDcr];
    const std::uint32_t target = 4 * (field(dcr, 0, 5) + burst_at_);
    burst_at_ = (burst_at_ + 1) % (field(dcr, 8, 5) + 1);
    return target;
}

}  // namespace tricoil::virtual_board

// Counting: periods, updates, compare values, interrupts.
#include "sim/virtual_board/peripherals/timer.hpp"

#include <algorithm>

#include "sim/virtual_board/peripherals/timer_registers.hpp"

namespace tricoil::virtual_board {

Timer::Timer(Machine& machine, Dma& dma, TimerParams params)
    : RegisterPeripheral(list(params)),
      machine_(machine),
      dma_(dma),
      params_(std::move(params)),
      max_count_(params_.bits == 32 ? 0xFFFFFFFFU : 0xFFFFU),
      channels_(channel_count(params_)),
      overflow_(machine.events, [this] { overflow(); }),
      match_(machine.events, [this] { settle(); }),
      capture_(machine.events, [this] {
          capture(0);
          schedule_capture();
          show_interrupt();
      }) {
    reset();
}

void Timer::clock_changed() {
    const std::uint32_t at = count();
    clock_ = params_.clock();
    restart(at);
    if (params_.input && capture_.is_due() != (params_.input(registers_[timer::kInputs]) > 0)) {
        schedule_capture();
    }
}

/// Counts since the period began.
std::uint32_t Timer::elapsed() const {
    if (!overflow_.is_due()) {
        return counts_down() ? reload_ - stopped_at_ : stopped_at_;
    }
    const Ticks left = overflow_.when() - machine_.now();
    return static_cast<std::uint32_t>(std::clamp<Ticks>((period() - left) / ticks_per_count(), 0, last()));
}

std::uint32_t Timer::count() const {
    if (!overflow_.is_due()) {
        return stopped_at_;
    }
    return counts_down() ? reload_ - elapsed() : elapsed();
}

/// Counts of the period at which a channel matches; larger than the period: never.
Ticks Timer::point(unsigned channel) const {
    const std::uint32_t centred = field(registers_[timer::kCr1], 5, 2);  // 1: matches only on the way down, 2: up, 3: both
    if (is_input(channel) || centred == (counts_down() ? 2U : 1U)) {
        return kNever;
    }
    return counts_down() && compare_[channel] <= reload_ ? reload_ - compare_[channel] : compare_[channel];
}

/// Value of ARR or a compare register in the present period. Dithering: the last four bits are the number of periods out of 16
/// that are one longer; a reversed count of the periods distributes them (RM0440, dithering mode).
std::uint32_t Timer::whole(std::uint32_t value) const {
    constexpr std::array<std::uint32_t, 16> kOrder{0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15};
    const std::uint32_t fine = value & (max_count_ << 4U | 15U);
    return dithers() ? (fine >> 4U) + (kOrder[phase_] < (fine & 15U) ? 1 : 0) : value & max_count_;
}

bool Timer::is_preloaded(unsigned channel) const { return is_set(registers_[timer::modes(channel)], 8 * (channel % 2) + 3); }

void Timer::restart(std::uint32_t count) {
    stopped_at_ = count;
    if (!is_running()) {
        overflow_.cancel();
        match_.cancel();
        return;
    }
    fail_if(count > reload_, "CNT is above ARR while the timer runs; counting to the maximum is not in this model");
    const std::uint32_t done = counts_down() ? reload_ - count : count;
    overflow_.in(period() - Ticks{done} * ticks_per_count());
    for (unsigned n = 0; n < channels_; ++n) {
        matched_[n] = point(n) < done;
    }
    schedule_match();
}

void Timer::schedule_match() {
    const std::uint32_t wanted = registers_[timer::kDier] | registers_[timer::kDier] >> 8U;  // interrupt or DMA
    Ticks next = kNever;
    for (unsigned n = 0; n < channels_; ++n) {
        if (is_set(wanted, n + 1) && !matched_[n] && point(n) <= last()) {
            next = std::min(next, point(n));
        }
    }
    if (next != kNever && overflow_.is_due()) {
        match_.at(overflow_.when() - period() + next * ticks_per_count());
    } else {
        match_.cancel();
    }
}

void Timer::settle() {
    if (params_.channels == 0 || !is_enabled()) {
        return;
    }
    const std::uint32_t done = elapsed();
    for (unsigned n = 0; n < channels_; ++n) {
        if (!matched_[n] && point(n) <= done) {
            match(n);
        }
    }
    schedule_match();
    show_interrupt();
}

void Timer::match(unsigned channel) {
    matched_[channel] = true;
    registers_.at(timer::kSr) |= timer::compare_flag(channel);
    if (is_set(registers_[timer::kDier], 9 + channel) && params_.compare_request) {
        request(*params_.compare_request + channel, timer::kUpdateBurst + 1 + channel);
    }
}

void Timer::overflow() {
    for (unsigned n = 0; n < channels_; ++n) {
        if (!matched_[n] && point(n) <= last()) {
            match(n);
        }
        matched_[n] = false;
    }
    if (is_centred()) {
        registers_.at(timer::kCr1) ^= 1U << timer::kDown;
    }
    phase_ = (phase_ + 1) % 16;
    stopped_at_ = counts_down() ? reload_ : 0;
    if (repetitions_ > 0) {
        --repetitions_;
    } else {
        update(false);
    }
    if (dithers()) {
        begin_period();
    }
    stopped_at_ = counts_down() ? reload_ : 0;
    if (is_running()) {
        overflow_.in(period());
        schedule_match();
    }
    show_interrupt();
}

/// CCRx of a channel, or ARR behind the last one.
std::uint32_t Timer::register_of(unsigned n) const { return n == channels_ ? timer::kArr : timer::compare(n); }

void Timer::load() {
    for (unsigned n = 0; n <= channels_; ++n) {
        active_[n] = registers_[register_of(n)];
    }
    begin_period();
}

/// Dithering: the active values differ from period to period.
void Timer::begin_period() {
    reload_ = whole(active_[channels_]);
    for (unsigned n = 0; n < channels_; ++n) {
        compare_[n] = whole(active_[n]);
    }
}

/// Update event: the preloaded registers take effect.
void Timer::update(bool by_software) {
    if (is_set(registers_[timer::kCr1], timer::kNoUpdates)) {
        return;
    }
    prescaler_ = registers_[timer::kPsc];
    load();
    if (params_.advanced) {
        repetitions_ = registers_[timer::kRcr];
    }
    if (!by_software || !is_set(registers_[timer::kCr1], timer::kOnlyOverflows)) {
        registers_.at(timer::kSr) |= 1U;
        if (is_set(registers_[timer::kDier], timer::kUpdateDma)) {
            request(*params_.update_request, timer::kUpdateBurst);
        }
    }
    if (!by_software && is_set(registers_[timer::kCr1], timer::kOnePulse)) {
        registers_.at(timer::kCr1) &= ~1U;
    }
    trigger(timer::by_update);
}

void Timer::show_interrupt() {
    const std::uint32_t wanted = registers_[timer::kSr] & registers_[timer::kDier] & 0x1FU;
    machine_.nvic.set_level(params_.update, (wanted & (params_.compare ? 1U : 0x1FU)) != 0);
    if (params_.compare) {
        machine_.nvic.set_level(*params_.compare, (wanted & 0x1EU) != 0);
    }
}

std::uint32_t Timer::read(std::uint32_t offset) {
    if (offset == timer::kCnt) {
        return count();
    }
    if (offset == timer::kSr) {
        settle();
    }
    if (offset == timer::kDmar && params_.channels > 0) {
        const std::uint32_t target = next_of_burst();
        return registers_.has(target) ? read(target) : 0;
    }
    if (const unsigned n = timer::channel_of(offset); n < params_.channels && is_input(n)) {
        registers_.at(timer::kSr) &= ~timer::compare_flag(n);  // reading takes the captured count
        show_interrupt();
    }
    return registers_.at(offset);
}

void Timer::write_reload(std::uint32_t value) {
    const std::uint32_t at = count();
    registers_.at(timer::kArr) = value;
    if (is_set(registers_[timer::kCr1], timer::kPreload)) {
        return;
    }
    fail_if(is_running() && at > whole(value),
            "ARR is set below CNT while the timer runs; counting to the maximum is not in this model");
    active_[channels_] = value;
    reload_ = whole(value);
    restart(at);
}

void Timer::write_compare(unsigned channel, std::uint32_t value) {
    if (is_input(channel)) {
        return;  // read-only
    }
    settle();
    registers_.at(timer::compare(channel)) = value;
    if (is_preloaded(channel)) {
        return;
    }
    active_[channel] = value;
    compare_[channel] = whole(value);
    matched_[channel] = is_enabled() && point(channel) < elapsed();
    schedule_match();
}

void Timer::generate(std::uint32_t value) {
    registers_.at(timer::kSr) |= value & 0x1EU;
    for (unsigned n = 0; n < params_.channels; ++n) {
        if (is_set(value, n + 1) && is_input(n)) {
            registers_.at(timer::compare(n)) = count();
        }
    }
    if (is_set(value, 0)) {
        divided_ = 0;
        update(true);
        registers_.at(timer::kCr1) &= is_centred() ? ~(1U << timer::kDown) : kAllBits;
        restart(counts_down() ? reload_ : 0);
        trigger(timer::by_reset);
    }
}

void Timer::control(std::uint32_t value) {
    settle();
    const std::uint32_t at = count();
    const std::uint32_t before = registers_[timer::kCr1];
    const bool starts = is_set(value, 0) && !is_set(before, 0);
    fail_if(is_set(value & before, 0) && (field(value, 5, 2) != 0) != is_centred(),
            "CR1: CMS changes between edge-aligned and centre-aligned while the timer runs");
    fail_if(is_set(value, timer::kDither) && field(value, 5, 2) != 0,
            "CR1: dithering of a centre-aligned timer (DITHEN, CMS) is not in this model");
    const std::uint32_t fixed = field(value, 5, 2) != 0 ? 1U << timer::kDown : 0U;  // DIR is read-only
    registers_.at(timer::kCr1) = (value & ~fixed) | (before & fixed);
    if (is_set(value ^ before, timer::kDither)) {  // the chip shifts the periods so that they stay the same
        const auto shift = [this](std::uint32_t& word) { word = dithers() ? word << 4U : word >> 4U; };
        for (unsigned n = 0; n <= channels_; ++n) {
            shift(registers_.at(register_of(n)));
            shift(active_[n]);
        }
        begin_period();
    }
    clock_ = params_.clock();
    restart(starts && counts_down() && at == 0 ? reload_ : at);
    if (starts) {
        trigger(timer::by_enable);
    }
}

void Timer::apply(std::uint32_t offset, std::uint32_t value) {
    if (const std::uint32_t kept = locked(offset); kept != 0) {
        value = (value & ~kept) | (registers_[offset] & kept);
    }
    switch (offset) {
        case timer::kCr1:
            control(value);
            break;
        case timer::kCr2:
            fail_if(field(value, 4, 3) > timer::by_update,
                    "CR2: only reset, enable and update (MMS = 0 to 2) are trigger outputs in this model");
            registers_.at(timer::kCr2) = value;
            break;
        case timer::kSmcr: {
            const std::uint32_t at = count();
            registers_.at(timer::kSmcr) = value;
            restart(at);
            break;
        }
        case timer::kSr:
            settle();
            registers_.at(timer::kSr) &= value;
            break;
        case timer::kEgr:
            generate(value);
            break;
        case timer::kCnt:
            restart(value & max_count_);
            break;
        case timer::kArr:
            write_reload(value);
            break;
        case timer::kInputs:
            fail_if(params_.input && params_.input(value) < 0,
                    "TISEL: only the pin, HSE/32, LSE and LSI can be input 1 in this model");
            registers_.at(timer::kInputs) = value;
            schedule_capture();
            break;
        case timer::kDmar:
            if (const std::uint32_t target = next_of_burst(); registers_.has(target)) {
                write(target, value);
            }
            break;
        default:
            if (const unsigned n = timer::channel_of(offset); n < channels_ && offset != timer::kBdtr) {
                write_compare(n, value);
                break;
            }
            registers_.at(offset) = value;
            lock_is_set_ = lock_is_set_ || offset == timer::kBdtr;
            burst_at_ = offset == timer::kDcr ? 0 : burst_at_;
            schedule_match();
            if (params_.input && (offset == timer::kModes || offset == timer::kCcer)) {
                schedule_capture();
            }
    }
    show_interrupt();
}

/// The bus duplicates a half-word; most registers have 16 bits.
void Timer::write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) {
    if (bytes != 2 || (offset & 3U) != 0) {
        Peripheral::write_narrow(offset, value, bytes);
    }
    write(offset, max_count_ > 0xFFFFU && offset >= timer::kCnt ? value | value << 16U : value);
}

void Timer::reset() {
    registers_.reset();
    overflow_.cancel();
    match_.cancel();
    capture_.cancel();
    lock_is_set_ = is_triggered_ = false;
    phase_ = divided_ = burst_at_ = 0;
    stopped_at_ = 0;
    prescaler_ = 0;
    load();
    repetitions_ = 0;
    matched_.fill(false);
    show_interrupt();
}

}  // namespace tricoil::virtual_board

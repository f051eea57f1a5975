#include "sim/virtual_board/peripherals/timer.hpp"

#include <algorithm>

namespace tricoil::virtual_board {
namespace timer {

constexpr std::uint32_t kCr1 = 0x00;
constexpr std::uint32_t kCr2 = 0x04;
constexpr std::uint32_t kSmcr = 0x08;
constexpr std::uint32_t kDier = 0x0C;
constexpr std::uint32_t kSr = 0x10;
constexpr std::uint32_t kEgr = 0x14;
constexpr std::uint32_t kModes = 0x18;  // CCMR1, CCMR2
constexpr std::uint32_t kCcer = 0x20;
constexpr std::uint32_t kCnt = 0x24;
constexpr std::uint32_t kPsc = 0x28;
constexpr std::uint32_t kArr = 0x2C;
constexpr std::uint32_t kRcr = 0x30;
constexpr std::uint32_t kBdtr = 0x44;
constexpr std::uint32_t kInputs = 0x5C;  // TISEL
constexpr std::uint32_t kDcr = 0x3DC;
constexpr std::uint32_t kDmar = 0x3E0;
constexpr std::uint32_t compare(unsigned channel) { return 0x34 + 4 * channel + (channel > 3 ? 4 : 0); }  // CCRx
constexpr unsigned channel_of(std::uint32_t offset) { return (offset - 0x34) / 4 - (offset > kBdtr ? 1 : 0); }
constexpr std::uint32_t modes(unsigned channel) { return channel > 3 ? 0x50 : kModes + 4 * (channel / 2); }  // CCMRx
constexpr std::uint32_t compare_flag(unsigned channel) { return channel > 3 ? 0x1000U << channel : 2U << channel; }

constexpr unsigned kNoUpdates = 1;      // UDIS
constexpr unsigned kOnlyOverflows = 2;  // URS
constexpr unsigned kOnePulse = 3;
constexpr unsigned kPreload = 7;
constexpr unsigned kUpdateDma = 8;
constexpr unsigned kDown = 4;  // DIR
constexpr unsigned kDither = 12;
constexpr std::uint32_t kUpdateBurst = 1;  // DCR.DBSS; those of the channels follow

}  // namespace timer

namespace {

enum TriggerMode : std::uint32_t { by_reset, by_enable, by_update };
enum SlaveMode : std::uint32_t { free_running, encoder = 3, reset_by_trigger, gated, start_by_trigger, count_triggers };

/// Number of the trigger input: 0 to 3 and from 8 other timers, 4 to 7 pins.
unsigned trigger_input(std::uint32_t smcr) { return field(smcr, 4, 3) | field(smcr, 20, 2) << 3U; }

}  // namespace

unsigned Timer::channel_count(const TimerParams& params) {
    return params.advanced && params.channels == 4 ? kMaxChannels : params.channels;
}

std::vector<Register> Timer::list(const TimerParams& params) {
    const std::uint32_t max = params.bits == 32 ? 0xFFFFFFFFU : 0xFFFFU;
    const std::uint32_t channels = ((1U << params.channels) - 1U) << 1U;  // bits of their flags
    std::vector<Register> all{
        {timer::kCr1, 0, "CR1", params.channels > 2 ? 0x13FFU : 0x139FU,
         params.channels > 2 ? "UIFREMAP@11" : "CMS@5-6 UIFREMAP@11"},
        {timer::kCr2, 0, "CR2", params.channels > 0 ? 0x3FF70U : 0x70U,
         "CCPC@0 CCUS@2 CCDS@3 TI1S@7 OIS@8-18 MMS2@20-23 MMS[3]@25"},
        {timer::kSmcr, 0, "SMCR", params.channels > 1 ? 0x30BFF7U : 0x80U,
         params.channels > 1 ? "OCCS@3 ECE@14 SMS[3]@16" : "SMS@0-2 TS@4-6"},
        {timer::kDier, 0, "DIER",
         1U | channels | (params.update_request ? 1U << timer::kUpdateDma : 0U) | (params.compare_request ? channels << 8U : 0U),
         "CC1IE@1 CC2IE@2 CC3IE@3 CC4IE@4 COMIE@5 TIE@6 BIE@7 UDE@8 CC1DE@9 CC2DE@10 CC3DE@11 CC4DE@12 COMDE@13 TDE@14"},
        {timer::kSr, 0, "SR", kAllBits},
        {timer::kEgr, 0, "EGR", 1U | channels, "CC1G@1 CC2G@2 CC3G@3 CC4G@4 COMG@5 TG@6 BG@7"},
        {timer::kCnt, 0, "CNT", kAllBits},
        {timer::kPsc, 0, "PSC", 0xFFFF},
        {timer::kArr, max, "ARR", max | 0xF0000U}};  // more bits than the counter: dithering
    static constexpr std::array kNames{"CCR1", "CCR2", "CCR3", "CCR4", "CCR5", "CCR6"};
    for (unsigned n = 0; n < channel_count(params); ++n) {
        all.push_back({timer::compare(n), 0, kNames[n], max | (n > 3 ? 0xE00F0000U : 0xF0000U)});
    }
    if (params.channels > 0) {
        all.push_back({timer::kModes, 0, "CCMR1", 0x0101FFFF});
        all.push_back({timer::kCcer, 0, "CCER", 0x33FFFF});
        all.push_back({0x50, 0, "CCMR3", 0x0101FCFC});
        all.push_back({0x54, 0, "DTR2", 0x300FF});
        all.push_back({0x58, 0, "ECR", 0x07FF00FF});
        all.push_back({timer::kInputs, 0, "TISEL", params.input ? 7U : 0U, "TI1SEL@0-3 TI2SEL@8-11 TI3SEL@16-19 TI4SEL@24-27"});
        all.push_back({0x60, params.advanced ? 1U : 0U, "AF1", 0x201, "BKCMP@1-8 BKCMPP@10-13 ETRSEL@14-17"});
        all.push_back({0x64, params.advanced ? 1U : 0U, "AF2", 0x201, "BK2CMP@1-8 BK2CMPP@10-13 OCRSEL@16-18"});
        all.push_back({timer::kDcr, 0, "DCR", 0xF1F1F});
        all.push_back({timer::kDmar, 0, "DMAR", kAllBits});
    }
    if (params.input) {
        all.push_back({0x68, 0, "OR1", 1});  // HSE32EN
    }
    if (params.channels > 2) {
        all.push_back({timer::kModes + 4, 0, "CCMR2", 0x0101FFFF});
    }
    if (params.advanced) {
        all.push_back({timer::kRcr, 0, "RCR", 0xFFFF});
        all.push_back({timer::kBdtr, 0, "BDTR", 0x03FFFFFF, "BKDSRM@26 BK2DSRM@27 BKBID@28 BK2BID@29"});
    }
    return all;
}

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

void Timer::connect(unsigned input, Timer& master) {
    masters_.at(input) = &master;
    master.on_trigger.emplace_back([this, input] { triggered(input); });
}

void Timer::clock_changed() {
    const std::uint32_t at = count();
    clock_ = params_.clock();
    restart(at);
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

bool Timer::is_input(unsigned channel) const { return field(registers_[timer::modes(channel)], 8 * (channel % 2), 2) != 0; }

/// True if the counter counts pulses of a trigger or edges of an encoder.
bool Timer::waits_for_triggers() const {
    const std::uint32_t smcr = params_.channels > 0 ? registers_[timer::kSmcr] : 0;
    const std::uint32_t mode = field(smcr, 0, 3);
    const Timer* const master = masters_[trigger_input(smcr) % masters_.size()];
    fail_if(mode == gated && (master == nullptr || field(master->registers_[timer::kCr2], 4, 3) != by_update),
            "SMCR: only the update of another timer can be the gate (SMS = 5) in this model");
    return mode != free_running && mode != reset_by_trigger && mode != start_by_trigger;
}

/// Value of ARR or a compare register in the present period. Dithering: the last four bits are the number of periods out of 16
/// that are one longer; a reversed count of the periods distributes them (RM0440, dithering mode).
std::uint32_t Timer::whole(std::uint32_t value) const {
    constexpr std::array<std::uint32_t, 16> kOrder{0, 8, 4, 12, 2, 10, 6, 14, 1, 9, 5, 13, 3, 11, 7, 15};
    const std::uint32_t fine = value & (max_count_ << 4U | 15U);
    return dithers() ? (fine >> 4U) + (kOrder[phase_] < (fine & 15U) ? 1 : 0) : value & max_count_;
}

/// Bits that BDTR.LOCK protects until the next reset.
std::uint32_t Timer::locked(std::uint32_t offset) const {
    const std::uint32_t level = params_.advanced ? field(registers_[timer::kBdtr], 8, 2) : 0;
    constexpr std::array<std::array<std::uint32_t, 3>, 6> kLocks{{{1, timer::kBdtr, 0x33FF70FF},
                                                                  {2, timer::kBdtr, 0xC00},
                                                                  {1, timer::kCr2, 0xFFF00},
                                                                  {2, timer::kCcer, 0x22AAAA},
                                                                  {3, timer::kModes, 0x01017878},
                                                                  {3, timer::kModes + 4, 0x01017878}}};
    std::uint32_t bits = lock_is_set_ && offset == timer::kBdtr ? 0x300 : 0;
    for (const auto& [from, place, mask] : kLocks) {
        bits |= level >= from && place == offset ? mask : 0;
    }
    return bits;
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

/// DMAR stands for one register after the other. A register that this timer does not have ignores it.
void Timer::burst(std::uint32_t value) {
    const std::uint32_t dcr = registers_[timer::kDcr];
    const std::uint32_t target = 4 * (field(dcr, 0, 5) + burst_at_);
    burst_at_ = (burst_at_ + 1) % (field(dcr, 8, 5) + 1);
    if (registers_.has(target)) {
        write(target, value);
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
        load();
    }
    stopped_at_ = counts_down() ? reload_ : 0;
    if (is_running()) {
        overflow_.in(period());
        schedule_match();
    }
    show_interrupt();
}

void Timer::load() {
    reload_ = whole(registers_[timer::kArr]);
    for (unsigned n = 0; n < channels_; ++n) {
        compare_[n] = whole(registers_[timer::compare(n)]);
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
    trigger(by_update);
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
    if (mode <= encoder || trigger_input(smcr) != input) {
        return;
    }
    registers_.at(timer::kSr) |= 1U << 6U;  // TIF
    if (mode == reset_by_trigger) {
        generate(1);
    } else if (mode == start_by_trigger && !is_enabled()) {
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
    show_interrupt();
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
        update(true);
        registers_.at(timer::kCr1) &= is_centred() ? ~(1U << timer::kDown) : kAllBits;
        restart(counts_down() ? reload_ : 0);
        trigger(by_reset);
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
        for (unsigned n = 0; n <= channels_; ++n) {
            std::uint32_t& word = registers_.at(n == channels_ ? timer::kArr : timer::compare(n));
            word = dithers() ? word << 4U : word >> 4U;
        }
        load();
    }
    clock_ = params_.clock();
    restart(starts && counts_down() && at == 0 ? reload_ : at);
    if (starts) {
        trigger(by_enable);
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
            fail_if(field(value, 4, 3) > by_update,
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
            burst(value);
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
    lock_is_set_ = false;
    phase_ = divided_ = burst_at_ = 0;
    stopped_at_ = 0;
    prescaler_ = 0;
    reload_ = registers_[timer::kArr];
    repetitions_ = 0;
    compare_.fill(0);
    matched_.fill(false);
    show_interrupt();
}

}  // namespace tricoil::virtual_board

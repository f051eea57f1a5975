#include "sim/virtual_board/peripherals/timer.hpp"

#include <algorithm>

namespace tricoil::virtual_board {
namespace timer {

constexpr std::uint32_t kCr1 = 0x00;
constexpr std::uint32_t kCr2 = 0x04;
constexpr std::uint32_t kDier = 0x0C;
constexpr std::uint32_t kSr = 0x10;
constexpr std::uint32_t kEgr = 0x14;
constexpr std::uint32_t kModes = 0x18;  // CCMR1, CCMR2
constexpr std::uint32_t kCnt = 0x24;
constexpr std::uint32_t kPsc = 0x28;
constexpr std::uint32_t kArr = 0x2C;
constexpr std::uint32_t kRcr = 0x30;
constexpr std::uint32_t kCompare = 0x34;  // CCR1; the others follow

constexpr unsigned kNoUpdates = 1;      // UDIS
constexpr unsigned kOnlyOverflows = 2;  // URS
constexpr unsigned kOnePulse = 3;
constexpr unsigned kPreload = 7;
constexpr unsigned kUpdateDma = 8;

}  // namespace timer

namespace {

enum TriggerMode : std::uint32_t { by_reset, by_enable, by_update };

}  // namespace

std::vector<Register> Timer::list(const TimerParams& params) {
    const std::uint32_t max = params.bits == 32 ? 0xFFFFFFFFU : 0xFFFFU;
    const std::uint32_t channels = ((1U << params.channels) - 1U) << 1U;  // bits of their flags
    std::vector<Register> all{
        {timer::kCr1, 0, "CR1", 0x39F, "CMS@5-6 UIFREMAP@11 DITHEN@12"},
        {timer::kCr2, 0, "CR2", params.channels > 0 ? 0x3FF70U : 0x70U,
         "CCPC@0 CCUS@2 CCDS@3 TI1S@7 OIS@8-18 MMS2@20-23 MMS[3]@25"},
        {0x08, 0, "SMCR", 0x80, "SMS@0-2 OCCS@3 TS@4-6 ETF@8-11 ETPS@12-13 ECE@14 ETP@15 SMS[3]@16 TS[4:3]@20-21"},
        {timer::kDier, 0, "DIER",
         1U | channels | (params.update_request ? 1U << timer::kUpdateDma : 0U) | (params.compare_request ? channels << 8U : 0U),
         "CC1IE@1 CC2IE@2 CC3IE@3 CC4IE@4 COMIE@5 TIE@6 BIE@7 UDE@8 CC1DE@9 CC2DE@10 CC3DE@11 CC4DE@12 COMDE@13 TDE@14"},
        {timer::kSr, 0, "SR", kAllBits},
        {timer::kEgr, 0, "EGR", 1U | channels, "CC1G@1 CC2G@2 CC3G@3 CC4G@4 COMG@5 TG@6 BG@7"},
        {timer::kCnt, 0, "CNT", kAllBits},
        {timer::kPsc, 0, "PSC", 0xFFFF},
        {timer::kArr, max, "ARR", max}};
    if (params.channels > 0) {
        all.push_back({timer::kModes, 0, "CCMR1", 0x01017C7C, "CC1S@0-1 OC1CE@7 CC2S@8-9 OC2CE@15"});
        all.push_back({0x20, 0, "CCER", 0xFFFF});
        static constexpr std::array kNames{"CCR1", "CCR2", "CCR3", "CCR4"};
        for (unsigned n = 0; n < params.channels; ++n) {
            all.push_back({timer::kCompare + 4 * n, 0, kNames[n], max});
        }
    }
    if (params.channels > 2) {
        all.push_back({timer::kModes + 4, 0, "CCMR2", 0x01017C7C, "CC3S@0-1 OC3CE@7 CC4S@8-9 OC4CE@15"});
    }
    if (params.channels > 0) {
        all.push_back({0x50, 0, "CCMR3", 0, "OC5M@2-7 OC6M@8-15 OC5M[3]@16 OC6M[3]@24"});
        all.push_back({0x54, 0, "DTR2", 0, "DTGF@0-7 DTAE@16 DTPE@17"});
        all.push_back({0x58, 0, "ECR", 0, "IE@0-31"});
        all.push_back({0x5C, 0, "TISEL", 0, "TI1SEL@0-3 TI2SEL@8-11 TI3SEL@16-19 TI4SEL@24-27"});
        all.push_back({0x60, params.advanced ? 1U : 0U, "AF1", 0, "BKINE@0 BKCMP@1-8 BKINP@9-13 ETRSEL@14-17"});
        all.push_back({0x64, params.advanced ? 1U : 0U, "AF2", 0, "BK2INE@0 BK2CMP@1-8 BK2INP@9-13 OCRSEL@16-18"});
    }
    if (params.advanced) {
        all.push_back({timer::kRcr, 0, "RCR", 0xFFFF});
        all.push_back(
            {0x44, 0, "BDTR", 0x020FECFF, "LOCK@8-9 BKE@12 BK2F@20-23 BK2E@24 BKDSRM@26 BK2DSRM@27 BKBID@28 BK2BID@29"});
    }
    return all;
}

Timer::Timer(Machine& machine, Dma& dma, TimerParams params)
    : RegisterPeripheral(list(params)),
      machine_(machine),
      dma_(dma),
      params_(std::move(params)),
      max_count_(params_.bits == 32 ? 0xFFFFFFFFU : 0xFFFFU),
      overflow_(machine.events, [this] { overflow(); }),
      match_(machine.events, [this] { settle(); }) {
    reset();
}

void Timer::clock_changed() {
    const std::uint32_t at = count();
    clock_ = params_.clock();
    restart(at);
}

/// Counts since the period began.
std::uint32_t Timer::elapsed() const {
    const Ticks left = overflow_.when() - machine_.now();
    return static_cast<std::uint32_t>(std::clamp<Ticks>((period() - left) / ticks_per_count(), 0, reload_));
}

std::uint32_t Timer::count() const {
    if (!overflow_.is_due()) {
        return stopped_at_;
    }
    return counts_down() ? reload_ - elapsed() : elapsed();
}

/// Counts of the period at which a channel matches; larger than the period: never.
std::uint32_t Timer::point(unsigned channel) const {
    return counts_down() && compare_[channel] <= reload_ ? reload_ - compare_[channel] : compare_[channel];
}

bool Timer::is_preloaded(unsigned channel) const {
    return is_set(registers_[timer::kModes + 4 * (channel / 2)], 8 * (channel % 2) + 3);
}

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
    for (unsigned n = 0; n < params_.channels; ++n) {
        matched_[n] = point(n) < done;
    }
    schedule_match();
}

void Timer::schedule_match() {
    const std::uint32_t wanted = registers_[timer::kDier] | registers_[timer::kDier] >> 8U;  // interrupt or DMA
    std::uint32_t next = max_count_;
    bool any = false;
    for (unsigned n = 0; n < params_.channels; ++n) {
        if (is_set(wanted, n + 1) && !matched_[n] && point(n) <= reload_) {
            next = std::min(next, point(n));
            any = true;
        }
    }
    if (any && overflow_.is_due()) {
        match_.at(overflow_.when() - period() + Ticks{next} * ticks_per_count());
    } else {
        match_.cancel();
    }
}

void Timer::settle() {
    if (params_.channels == 0 || !overflow_.is_due()) {
        return;
    }
    const std::uint32_t done = elapsed();
    for (unsigned n = 0; n < params_.channels; ++n) {
        if (!matched_[n] && point(n) <= done) {
            match(n);
        }
    }
    schedule_match();
    show_interrupt();
}

void Timer::match(unsigned channel) {
    matched_[channel] = true;
    registers_.at(timer::kSr) |= 2U << channel;
    if (is_set(registers_[timer::kDier], 9 + channel) && params_.compare_request) {
        (void)dma_.request(*params_.compare_request + channel);
    }
}

void Timer::overflow() {
    for (unsigned n = 0; n < params_.channels; ++n) {
        if (!matched_[n] && point(n) <= reload_) {
            match(n);
        }
        matched_[n] = false;
    }
    if (repetitions_ > 0) {
        --repetitions_;
    } else {
        update(false);
    }
    stopped_at_ = counts_down() ? reload_ : 0;
    if (is_running()) {
        overflow_.in(period());
        if (params_.channels > 0) {
            schedule_match();
        }
    }
    show_interrupt();
}

/// Update event: the preloaded registers take effect.
void Timer::update(bool by_software) {
    if (is_set(registers_[timer::kCr1], timer::kNoUpdates)) {
        return;
    }
    prescaler_ = registers_[timer::kPsc];
    reload_ = registers_[timer::kArr];
    if (params_.advanced) {
        repetitions_ = registers_[timer::kRcr];
    }
    for (unsigned n = 0; n < params_.channels; ++n) {
        compare_[n] = registers_[timer::kCompare + 4 * n];
    }
    if (!by_software || !is_set(registers_[timer::kCr1], timer::kOnlyOverflows)) {
        registers_.at(timer::kSr) |= 1U;
        if (is_set(registers_[timer::kDier], timer::kUpdateDma)) {
            (void)dma_.request(*params_.update_request);
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

void Timer::show_interrupt() {
    const std::uint32_t wanted = registers_[timer::kSr] & registers_[timer::kDier] & 0x1FU;
    const std::uint32_t on_update_line = params_.compare ? wanted & 1U : wanted;
    machine_.nvic.set_level(params_.update, on_update_line != 0);
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
    return registers_.at(offset);
}

void Timer::write_reload(std::uint32_t value) {
    const std::uint32_t at = count();
    registers_.at(timer::kArr) = value;
    if (is_set(registers_[timer::kCr1], timer::kPreload)) {
        return;
    }
    fail_if(is_running() && at > value,
            "ARR is set below CNT while the timer runs; counting to the maximum is not in this model");
    reload_ = value;
    restart(at);
}

void Timer::write_compare(unsigned channel, std::uint32_t value) {
    settle();
    registers_.at(timer::kCompare + 4 * channel) = value;
    if (is_preloaded(channel)) {
        return;
    }
    compare_[channel] = value;
    matched_[channel] = overflow_.is_due() && point(channel) < elapsed();
    schedule_match();
}

void Timer::generate(std::uint32_t value) {
    registers_.at(timer::kSr) |= value & 0x1EU;
    if (is_set(value, 0)) {
        update(true);
        restart(counts_down() ? reload_ : 0);
        trigger(by_reset);
    }
}

void Timer::apply(std::uint32_t offset, std::uint32_t value) {
    switch (offset) {
        case timer::kCr1: {
            settle();
            const std::uint32_t at = count();
            const bool starts = is_set(value, 0) && !is_set(registers_[timer::kCr1], 0);
            registers_.at(timer::kCr1) = value;
            clock_ = params_.clock();
            restart(starts && counts_down() && at == 0 ? reload_ : at);
            if (starts) {
                trigger(by_enable);
            }
            break;
        }
        case timer::kCr2:
            fail_if(field(value, 4, 3) > by_update,
                    "CR2: only reset, enable and update (MMS = 0 to 2) are trigger outputs in this model");
            registers_.at(timer::kCr2) = value;
            break;
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
        default:
            if (offset >= timer::kCompare && offset < timer::kCompare + 4 * params_.channels) {
                write_compare((offset - timer::kCompare) / 4, value);
            } else {
                registers_.at(offset) = value;
                schedule_match();
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
    stopped_at_ = 0;
    prescaler_ = 0;
    reload_ = registers_[timer::kArr];
    repetitions_ = 0;
    compare_.fill(0);
    matched_.fill(false);
    show_interrupt();
}

}  // namespace tricoil::virtual_board

#include "sim/virtual_board/peripherals/adc.hpp"

#include <algorithm>
#include <utility>

namespace tricoil::virtual_board {
namespace {

std::vector<Register> adc_registers() {
    constexpr const char* kOffsets = "OFFSETPOS@24";
    return {{0x00, 0, "ISR", kAllBits},
            {0x04, 0, "IER", 0xFD, "EOSMPIE@1 AWD2IE@8 AWD3IE@9 JQOVFIE@10"},
            {0x08, 0, "CR", 0xB000003F, "ADCALDIF@30"},
            {0x0C, 0x80000000, "CFGR", 0xFFDEBFFB, "AUTDLY@14 DISCEN@16 JQM@21"},
            {0x10, 0, "CFGR2", 0x107FF, "SWTRIG@25 BULB@26 SMPTRIG@27"},
            {0x14, 0, "SMPR1", 0x3FFFFFFF, "SMPPLUS@31"},
            {0x18, 0, "SMPR2", 0x07FFFFFF},
            {0x20, 0x0FFF0000, "TR1", 0x0FFF0FFF, "AWDFILT@12-14"},
            {0x24, 0x00FF0000, "TR2", 0, "LT2@0-7 HT2@16-23"},
            {0x28, 0x00FF0000, "TR3", 0, "LT3@0-7 HT3@16-23"},
            {0x30, 0, "SQR1", kAllBits},
            {0x34, 0, "SQR2", kAllBits},
            {0x38, 0, "SQR3", kAllBits},
            {0x3C, 0, "SQR4", kAllBits},
            {0x40, 0, "DR", kAllBits},
            {0x4C, 0, "JSQR", 0xFBEFBFFF},
            {0x60, 0, "OFR1", 0xFE000FFF, kOffsets},
            {0x64, 0, "OFR2", 0xFE000FFF, kOffsets},
            {0x68, 0, "OFR3", 0xFE000FFF, kOffsets},
            {0x6C, 0, "OFR4", 0xFE000FFF, kOffsets},
            {0x80, 0, "JDR1", kAllBits},
            {0x84, 0, "JDR2", kAllBits},
            {0x88, 0, "JDR3", kAllBits},
            {0x8C, 0, "JDR4", kAllBits},
            {0xA0, 0, "AWD2CR", 0, "AWD2CH@0-18"},
            {0xA4, 0, "AWD3CR", 0, "AWD3CH@0-18"},
            {0xB0, 0, "DIFSEL", 0, "DIFSEL@0-18"},
            {0xB4, 0, "CALFACT", 0x7F, "CALFACT_D@16-22"},
            {0xC0, 0, "GCOMP", 0x3FFF}};
}

}  // namespace

Adc::Adc(Machine& machine, Dma& dma, const AdcCommon& common, const AdcParams& params)
    : RegisterPeripheral(adc_registers()),
      machine_(machine),
      dma_(dma),
      common_(common),
      params_(params),
      ready_(machine.events,
             [this] {
                 state_.is_ready = true;
                 state_.flags |= 1U << adc::kReady;
                 show_interrupt();
             }),
      calibrated_(machine.events,
                  [this] {
                      state_.control &= ~(1U << adc::kCalibrate);
                      registers_.at(adc::kCalibration) = 0x40;
                      converted_ = machine_.now();
                  }),
      finished_(machine.events, [this] { finish(); }) {
    dma_.on_enable(params_.request, [this] { state_.waits = state_.waits && !dma_.request(params_.request); });
    reset();
}

unsigned Adc::channel() const {
    if (state_.injects) {
        return field(registers_[adc::kJsqr], 9 + 6 * state_.injected_rank, 5);
    }
    const unsigned place = state_.rank + 1;  // SQR1 begins with the length
    return field(registers_[adc::kSqr1 + 4 * (place / 5)], 6 * (place % 5), 5);
}

Ticks Adc::sampling_time() const {
    const unsigned n = channel();
    const std::uint32_t code =
        n < 10 ? field(registers_[adc::kSmpr1], 3 * n, 3) : field(registers_[adc::kSmpr2], 3 * (n - 10), 3);
    return adc::kSampling2[code] * common_.clock() / 2;
}

bool Adc::is_by_software() const { return field(registers_[adc::kCfgr], 10, 2) == 0; }

/// `settings`: number of the source in five bits, then the edge.
bool Adc::is_triggered(std::uint32_t settings, unsigned source) {
    const std::uint32_t edge = settings >> 5U;
    const bool is_chosen = edge != 0 && field(settings, 0, 5) == source;
    fail_if(is_chosen && edge == 2, "conversions on the falling edge of a trigger are not in this model");
    return is_chosen;
}

void Adc::trigger(unsigned source, unsigned injected_source) {
    if (is_set(state_.control, adc::kStartInjected) && is_triggered(field(registers_[adc::kJsqr], 2, 7), injected_source)) {
        fail_if(state_.injects, "an injected sequence lasts longer than the time between two triggers");
        inject();
    }
    const std::uint32_t cfgr = registers_[adc::kCfgr];
    if (!runs() || !is_triggered(field(cfgr, 5, 7), source)) {
        return;
    }
    const bool converts = state_.postponed || (finished_.is_due() && !state_.injects);
    if (converts && is_set(cfgr, adc::kContinuous)) {
        return;
    }
    fail_if(converts, "a conversion lasts longer than the time between two triggers");
    convert_regular();
}

/// At once, or after the injected sequence that runs.
void Adc::convert_regular() {
    state_.postponed = state_.injects;
    if (!state_.injects) {
        convert();
    }
}

void Adc::convert() {
    if (!stuck_) {
        const Ticks converting = adc::kConverting2[field(registers_[adc::kCfgr], 3, 2)] * common_.clock() / 2;
        finished_.in(sampling_time() + converting);
    }
}

bool Adc::may_be_wrong() const { return !converted_ || machine_.now() - *converted_ > ticks(adc::kMaxIdleS); }

/// Gain, offset and alignment of a result.
std::uint32_t Adc::corrected(std::uint32_t code) const {
    const std::uint32_t cfgr = registers_[adc::kCfgr];
    if (is_set(registers_[adc::kCfgr2], adc::kGainOn)) {
        code = std::min(code * registers_[adc::kGain] / 4096, 0xFFFFU);
    }
    for (std::uint32_t offset = adc::kOffset1; offset < adc::kOffset1 + 16; offset += 4) {
        const std::uint32_t setting = registers_[offset];
        if (is_set(setting, 31) && field(setting, 26, 5) == channel() && !oversamples_any()) {
            const std::uint32_t shift = 2 * field(cfgr, 3, 2);
            code -= field(setting, 0, 12) >> shift;
            const bool saturates = is_set(setting, 25);
            code = saturates && static_cast<std::int32_t>(code) < 0 ? 0 : code;
        }
    }
    return (is_aligned_left() ? code << adc::kLeftShifts[field(cfgr, 3, 2)] : code) & 0xFFFFU;
}

void Adc::finish() {
    const std::uint32_t resolution = field(registers_[adc::kCfgr], 3, 2);
    const Ticks held = machine_.now() - adc::kConverting2[resolution] * common_.clock() / 2;
    std::uint32_t code = sample ? sample(held) : 0;
    code ^= may_be_wrong() ? first_error_ : 0U;
    code >>= 2 * resolution;
    converted_ = machine_.now();
    state_.flags |= 1U << adc::kEndOfSampling;
    if (!oversamples()) {
        store(corrected(code));
        return;
    }
    auto& [sum, codes] = state_.sums[state_.injects ? 1 : 0];
    sum += code;
    const unsigned ratio = 2U << field(registers_[adc::kCfgr2], 2, 3);
    if (++codes == ratio) {
        const std::uint32_t result = std::exchange(sum, 0) >> field(registers_[adc::kCfgr2], 5, 4) & 0xFFFFU;
        codes = 0;
        store(corrected(result));
    } else if (state_.injects || !is_set(registers_[adc::kCfgr2], adc::kTriggerEach)) {
        convert();
    }
}

void Adc::store(std::uint32_t result) {
    check_watchdog(result);
    if (state_.injects) {
        store_injected(result);
    } else {
        store_regular(result);
    }
    show_interrupt();
}

void Adc::store_regular(std::uint32_t result) {
    const std::uint32_t cfgr = registers_[adc::kCfgr];
    const bool unread = is_set(state_.flags, adc::kEndOfConversion);
    state_.flags |= flag(unread, adc::kOverrun);
    // Without OVRMOD the unread result stays, and later ones are lost until the flag is cleared (RM0440, ADC overrun).
    if (!is_set(state_.flags, adc::kOverrun) || is_set(cfgr, adc::kOverwrite)) {
        registers_.at(adc::kDr) = result;
    }
    state_.flags |= 1U << adc::kEndOfConversion;
    on_result(result);
    if (is_set(cfgr, adc::kDma) &&
        !is_set(state_.flags, adc::kOverrun)) {  // after an overrun there are no more requests until the flag is cleared
        state_.waits = !dma_.request(params_.request);
    }
    advance_sequence();
}

void Adc::advance_sequence() {
    const std::uint32_t cfgr = registers_[adc::kCfgr];
    const bool last = state_.rank == field(registers_[adc::kSqr1], 0, 4);
    state_.rank = last ? 0 : state_.rank + 1;
    state_.flags |= flag(last, adc::kEndOfSequence);
    if (state_.waits && !is_set(cfgr, adc::kDmaEndless)) {  // the DMA has moved its last item
        state_.rank = 0;
        return;
    }
    if (!runs()) {
        return;
    }
    const bool again = is_set(cfgr, adc::kContinuous);
    if (last && !again && is_by_software()) {
        state_.control &= ~(1U << adc::kStart);
    }
    if (last && is_automatic()) {
        inject();
        state_.postponed = again;
    } else if (!last || again) {
        convert();
    }
}

void Adc::check_watchdog(std::uint32_t result) {
    const std::uint32_t cfgr = registers_[adc::kCfgr];
    const bool is_watched = is_set(cfgr, state_.injects ? 24 : 23) && (!is_set(cfgr, 22) || field(cfgr, 26, 5) == channel());
    const std::uint32_t seen = oversamples()       ? result >> 4U
                               : is_aligned_left() ? result >> (adc::kLeftShifts[field(cfgr, 3, 2)] - 2 * field(cfgr, 3, 2))
                                                   : result << 2 * field(cfgr, 3, 2);
    const std::uint32_t limits = registers_[adc::kTr1];
    if (is_watched && (seen < field(limits, 0, 12) || seen > field(limits, 16, 12))) {
        state_.flags |= 1U << adc::kWatchdog1;
    }
}

void Adc::show_interrupt() { machine_.nvic.set_level(params_.interrupt, (state_.flags & registers_[adc::kIer]) != 0); }

bool Adc::is_powered() const { return is_set(state_.control, adc::kRegulator) && !is_set(state_.control, adc::kDeepPowerDown); }

void Adc::power(std::uint32_t value) {
    constexpr std::uint32_t kPowers = 1U << adc::kRegulator | 1U << adc::kDeepPowerDown;
    state_.control = (state_.control & ~kPowers) | (value & kPowers);
    if (!is_powered()) {
        regulated_from_.reset();
    } else if (!regulated_from_) {
        regulated_from_ = machine_.now() + ticks(adc::kRegulatorStartS);
    }
}

void Adc::calibrate() {
    fail_if(!is_powered() || is_set(state_.control, adc::kEnable),
            "calibration requires the regulator to be on and the converter to be disabled");
    fail_if(machine_.now() < *regulated_from_, "calibration starts before the regulator is ready");
    state_.control |= 1U << adc::kCalibrate;
    calibrated_.in(adc::kCalibrationCycles * common_.clock());
}

void Adc::enable() {
    fail_if(!is_powered() || is_set(state_.control, adc::kCalibrate),
            "converter is enabled without its regulator, or during calibration");
    fail_if(static_cast<double>(kTicksPerSecond) > adc::kMaxHz * static_cast<double>(common_.clock()),
            "the converter clock is above 60 MHz");
    state_.control |= 1U << adc::kEnable;
    state_.is_ready = false;
    ready_.in(ticks(adc::kReadyS));
}

void Adc::start() {
    state_.control |= 1U << adc::kStart;
    state_.sums[0] = {};
    state_.rank = 0;
    state_.waits = false;
    if (is_by_software()) {
        convert_regular();
    }
}

void Adc::stop() {
    state_.control &= ~(1U << adc::kStart);
    state_.postponed = false;
    if (is_automatic()) {  // ADSTP ends both sequences
        state_.injects = false;
        state_.injected_rank = 0;
    }
    if (!state_.injects) {
        finished_.cancel();
    }
    converted_.reset();
    state_.rank = 0;
}

void Adc::control(std::uint32_t value) {
    power(value);
    if (is_set(value, adc::kCalibrate)) {
        calibrate();
        return;
    }
    if (is_set(value, adc::kEnable) && !is_set(state_.control, adc::kEnable)) {
        enable();
    }
    if (is_set(value, adc::kDisable)) {
        fail_if(is_busy(), "the converter is disabled (ADDIS) while it converts; stop it with ADSTP or JADSTP first");
        state_.control &= ~(1U << adc::kEnable);
        state_.is_ready = false;
        ready_.cancel();
    }
    const bool starts = is_set(value, adc::kStart) || is_set(value, adc::kStartInjected);
    fail_if(starts && !state_.is_ready, "conversion starts before ADRDY");
    if (is_set(value, adc::kStart) && !runs()) {
        start();
    }
    if (is_set(value, adc::kStartInjected) && !is_set(state_.control, adc::kStartInjected)) {
        start_injected();
    }
    if (is_set(value, adc::kStop) && (runs() || (is_automatic() && state_.injects))) {
        stop();
    }
    if (is_set(value, adc::kStopInjected) && is_set(state_.control, adc::kStartInjected)) {
        stop_injected();
    }
}

std::uint32_t Adc::read(std::uint32_t offset) {
    switch (offset) {
        case adc::kIsr:
            return state_.flags;
        case adc::kCr:
            return state_.control;
        case adc::kDr:  // takes the result, so nothing is left for the DMA
            state_.flags &= ~(1U << adc::kEndOfConversion);
            state_.waits = false;
            show_interrupt();
            return registers_[adc::kDr];
        default:
            if (offset - adc::kJdr1 < 16) {
                state_.flags &= ~(1U << adc::kEndOfInjectedConversion);
                show_interrupt();
            }
            return registers_.at(offset);
    }
}

void Adc::apply(std::uint32_t offset, std::uint32_t value) {
    const bool set_up = offset != adc::kIsr && offset != adc::kIer && offset != adc::kCr && offset != adc::kTr1;
    const bool is_sequence = offset >= adc::kSqr1 && offset < adc::kDr;
    fail_if(set_up && ((runs() && offset != adc::kJsqr) || (injects_or_waits() && !is_sequence)),
            "register is written while conversions run");
    fail_if(offset == adc::kDr || offset - adc::kJdr1 < 16, "results are read-only");
    switch (offset) {
        case adc::kIsr:
            state_.flags &= ~value;
            break;
        case adc::kCr:
            control(value);
            break;
        case adc::kCfgr:
            registers_.at(adc::kJsqr) &= is_set(value ^ registers_[adc::kCfgr], adc::kQueueOff) ? 0U : kAllBits;
            [[fallthrough]];
        default:
            registers_.at(offset) = value;
    }
    show_interrupt();
}

void Adc::reset() {
    registers_.reset();
    state_ = {};
    regulated_from_.reset();
    converted_.reset();
    ready_.cancel();
    calibrated_.cancel();
    finished_.cancel();
    show_interrupt();
}

}  // namespace tricoil::virtual_board

#include "sim/virtual_board/peripherals/adc.hpp"

#include <algorithm>
#include <array>

namespace tricoil::virtual_board {
namespace adc {

constexpr std::uint32_t kIsr = 0x00;
constexpr std::uint32_t kIer = 0x04;
constexpr std::uint32_t kCr = 0x08;
constexpr std::uint32_t kCfgr = 0x0C;
constexpr std::uint32_t kCfgr2 = 0x10;
constexpr std::uint32_t kSmpr1 = 0x14;
constexpr std::uint32_t kSmpr2 = 0x18;
constexpr std::uint32_t kTr1 = 0x20;
constexpr std::uint32_t kSqr1 = 0x30;
constexpr std::uint32_t kDr = 0x40;
constexpr std::uint32_t kOffset1 = 0x60;
constexpr std::uint32_t kCalibration = 0xB4;
constexpr std::uint32_t kGain = 0xC0;

constexpr unsigned kReady = 0;
constexpr unsigned kEndOfSampling = 1;
constexpr unsigned kEndOfConversion = 2;
constexpr unsigned kEndOfSequence = 3;
constexpr unsigned kOverrun = 4;
constexpr unsigned kWatchdog1 = 7;

constexpr unsigned kEnable = 0;
constexpr unsigned kDisable = 1;
constexpr unsigned kStart = 2;
constexpr unsigned kStop = 4;
constexpr unsigned kRegulator = 28;
constexpr unsigned kDeepPowerDown = 29;
constexpr unsigned kCalibrate = 31;

// Bits of CFGR and CFGR2.
constexpr unsigned kDma = 0;
constexpr unsigned kDmaEndless = 1;
constexpr unsigned kOverwrite = 12;
constexpr unsigned kContinuous = 13;
constexpr unsigned kAlignLeft = 15;
constexpr unsigned kOversample = 0;
constexpr unsigned kTriggerEach = 9;
constexpr unsigned kGainOn = 16;

constexpr double kReadyS = 1e-6;            // DS12288, stabilisation time after power-up
constexpr double kRegulatorStartS = 20e-6;  // DS12288, start-up time of the converter's voltage regulator
constexpr Ticks kCalibrationCycles = 116;
constexpr double kMaxHz = 60e6;  // DS12288, one converter at 12 bits
// Sampling times of the SMPR codes, and conversion times of the RES codes, in half cycles.
constexpr std::array<int, 8> kSampling2{5, 13, 25, 49, 95, 185, 495, 1281};
constexpr std::array<int, 4> kConverting2{25, 21, 17, 13};
constexpr std::array<unsigned, 4> kLeftShifts{4, 6, 8, 2};
constexpr double kMaxIdleS = 1e-3;  // ES0430 2.7.9

}  // namespace adc

namespace {

std::vector<Register> adc_registers() {
    constexpr const char* kOffsets = "OFFSETPOS@24";
    return {{0x00, 0, "ISR", kAllBits},
            {0x04, 0, "IER", 0x9D, "EOSMPIE@1 JEOCIE@5 JEOSIE@6 AWD2IE@8 AWD3IE@9 JQOVFIE@10"},
            {0x08, 0, "CR", 0xB0000017, "JADSTART@3 JADSTP@5 ADCALDIF@30"},
            {0x0C, 0x80000000, "CFGR", 0xFCCEBFFB, "AUTDLY@14 DISCEN@16 JDISCEN@20 JQM@21 JAWD1EN@24 JAUTO@25"},
            {0x10, 0, "CFGR2", 0x103FD, "JOVSE@1 ROVSM@10 SWTRIG@25 BULB@26 SMPTRIG@27"},
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
            {0x4C, 0, "JSQR", 0, "JL@0-1 JEXTSEL@2-6 JEXTEN@7-8 JSQ1@9-13 JSQ2@15-19 JSQ3@21-25 JSQ4@27-31"},
            {0x60, 0, "OFR1", 0xFE000FFF, kOffsets},
            {0x64, 0, "OFR2", 0xFE000FFF, kOffsets},
            {0x68, 0, "OFR3", 0xFE000FFF, kOffsets},
            {0x6C, 0, "OFR4", 0xFE000FFF, kOffsets},
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

void Adc::trigger(unsigned source) {
    const std::uint32_t cfgr = registers_[adc::kCfgr];
    if (!runs() || is_by_software() || field(cfgr, 5, 5) != source) {
        return;
    }
    fail_if(field(cfgr, 10, 2) == 2, "conversions on the falling edge of a trigger are not in this model");
    fail_if(finished_.is_due(), "a conversion lasts longer than the time between two triggers");
    convert();
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
        if (is_set(setting, 31) && field(setting, 26, 5) == channel()) {
            const std::uint32_t shift = 2 * field(cfgr, 3, 2);
            code -= field(setting, 0, 12) >> shift;
            const bool saturates = is_set(setting, 25);
            code = saturates && static_cast<std::int32_t>(code) < 0 ? 0 : code;
        }
    }
    const bool left = is_set(cfgr, adc::kAlignLeft) && !is_set(registers_[adc::kCfgr2], adc::kOversample);
    return (left ? code << adc::kLeftShifts[field(cfgr, 3, 2)] : code) & 0xFFFFU;
}

void Adc::finish() {
    const std::uint32_t resolution = field(registers_[adc::kCfgr], 3, 2);
    const Ticks held = machine_.now() - adc::kConverting2[resolution] * common_.clock() / 2;
    std::uint32_t code = sample ? sample(held) : 0;
    code ^= may_be_wrong() ? first_error_ : 0U;
    code >>= 2 * resolution;
    converted_ = machine_.now();
    state_.flags |= 1U << adc::kEndOfSampling;
    if (!is_set(registers_[adc::kCfgr2], adc::kOversample)) {
        store_result(corrected(code));
        return;
    }
    state_.sum += code;
    const unsigned ratio = 2U << field(registers_[adc::kCfgr2], 2, 3);
    if (++state_.summed == ratio) {
        const std::uint32_t result = state_.sum >> field(registers_[adc::kCfgr2], 5, 4) & 0xFFFFU;
        state_.sum = 0;
        state_.summed = 0;
        store_result(corrected(result));
    } else if (!is_set(registers_[adc::kCfgr2], adc::kTriggerEach)) {
        convert();
    }
}

void Adc::store_result(std::uint32_t result) {
    check_watchdog(result);
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
    show_interrupt();
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
    if (!last || is_set(cfgr, adc::kContinuous)) {
        convert();
    } else if (is_by_software()) {
        state_.control &= ~(1U << adc::kStart);
    }
}

void Adc::check_watchdog(std::uint32_t result) {
    const std::uint32_t cfgr = registers_[adc::kCfgr];
    const bool is_watched = is_set(cfgr, 23) && (!is_set(cfgr, 22) || field(cfgr, 26, 5) == channel());
    const bool oversamples = is_set(registers_[adc::kCfgr2], adc::kOversample);
    const std::uint32_t seen = oversamples ? result >> 4U
                               : is_set(cfgr, adc::kAlignLeft)
                                   ? result >> (adc::kLeftShifts[field(cfgr, 3, 2)] - 2 * field(cfgr, 3, 2))
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
    fail_if(!is_set(state_.control, adc::kEnable) || !state_.is_ready, "conversion starts before ADRDY");
    if (runs()) {
        return;
    }
    state_.control |= 1U << adc::kStart;
    state_.sum = 0;
    state_.summed = 0;
    state_.rank = 0;
    state_.waits = false;
    if (is_by_software()) {
        convert();
    }
}

void Adc::stop() {
    state_.control &= ~(1U << adc::kStart);
    finished_.cancel();
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
        fail_if(runs(), "the converter is disabled (ADDIS) while it converts; stop it with ADSTP first");
        state_.control &= ~(1U << adc::kEnable);
        state_.is_ready = false;
        ready_.cancel();
    }
    if (is_set(value, adc::kStart)) {
        start();
    }
    if (is_set(value, adc::kStop) && runs()) {
        stop();
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
            return registers_.at(offset);
    }
}

void Adc::apply(std::uint32_t offset, std::uint32_t value) {
    const bool set_up = offset != adc::kIsr && offset != adc::kIer && offset != adc::kCr && offset != adc::kTr1;
    fail_if(set_up && runs(), "register is written while conversions run");
    switch (offset) {
        case adc::kIsr:
            state_.flags &= ~value;
            break;
        case adc::kCr:
            control(value);
            break;
        case adc::kDr:
            throw RunFailure("DR is read-only");
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

#include "sim/virtual_board/peripherals/adc.hpp"

#include <array>

namespace tricoil::virtual_board {
namespace {

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

constexpr unsigned kReady = 0;
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

constexpr double kReadyS = 1e-6;            // DS12288, stabilisation time after power-up
constexpr double kRegulatorStartS = 20e-6;  // DS12288, start-up time of the converter's voltage regulator
constexpr double kCalibrationCycles = 116;
constexpr double kMaxHz = 60e6;  // DS12288, one converter at 12 bits
// Sampling times of the SMPR codes, in half cycles.
constexpr std::array<int, 8> kSampling2{5, 13, 25, 49, 95, 185, 495, 1281};
constexpr int kConverting2 = 25;
constexpr double kMaxIdleS = 1e-3;  // ES0430 2.7.10

}  // namespace

unsigned AdcCommon::divider() const {
    const std::uint32_t mode = field(registers_[0x08], 16, 2);
    if (mode == 0) {
        throw RunFailure("the converters' asynchronous clock is not in this model; set CKMODE");
    }
    return 1U << (mode - 1U);
}

Adc::Adc(Machine& machine, Dma& dma, const AdcCommon& common, const AdcParams& params)
    : machine_(machine),
      dma_(dma),
      common_(common),
      params_(params),
      registers_{{kIsr, 0},   {kIer, 0},   {kCr, 0},           {kCfgr, 0x80000000}, {kCfgr2, 0},
                 {kSmpr1, 0}, {kSmpr2, 0}, {kTr1, 0x0FFF0000}, {0x24, 0x00FF0000},  {0x28, 0x00FF0000},
                 {kSqr1, 0},  {kDr, 0},    {0xB0, 0},          {0xB4, 0},           {0xC0, 0}},
      ready_(machine.events, [this] { flags_ |= 1U << kReady; }),
      calibrated_(machine.events, [this] {
          control_ &= ~(1U << kCalibrate);
          converted_ = machine_.now();
      }) {
    reset();
}

Ticks Adc::sampling_time() const {
    const unsigned n = channel();
    const std::uint32_t code = n < 10 ? field(registers_[kSmpr1], 3 * n, 3) : field(registers_[kSmpr2], 3 * (n - 10), 3);
    return kSampling2[code] * Ticks{common_.divider()} * machine_.cpu.ticks_per_cycle() / 2;
}

Ticks Adc::conversion_time() const {
    return sampling_time() + kConverting2 * Ticks{common_.divider()} * machine_.cpu.ticks_per_cycle() / 2;
}

void Adc::trigger(unsigned source) {
    const std::uint32_t cfgr = registers_[kCfgr];
    if (runs() && field(cfgr, 10, 2) == 1 && field(cfgr, 5, 5) == source) {
        converting_ = !stuck_;
    }
}

bool Adc::may_be_wrong() const { return !converted_ || machine_.now() - *converted_ > ticks(kMaxIdleS); }

void Adc::finish(std::uint32_t code) {
    converting_ = false;
    code ^= may_be_wrong() ? first_error_ : 0U;
    converted_ = machine_.now();
    if (!is_set(registers_[kCfgr2], 0)) {
        store_result(code);
        return;
    }
    sum_ += code;
    const unsigned ratio = 2U << field(registers_[kCfgr2], 2, 3);
    if (++summed_ == ratio) {
        const std::uint32_t result = sum_ >> field(registers_[kCfgr2], 5, 4) & 0xFFFFU;
        sum_ = 0;
        summed_ = 0;
        store_result(result);
    }
}

void Adc::store_result(std::uint32_t result) {
    check_watchdog(result);
    const bool by_dma = is_set(registers_[kCfgr], 0);
    const bool unread = is_set(flags_, kEndOfConversion);
    if (unread) {
        flags_ |= 1U << kOverrun;
    }
    if (!unread || is_set(registers_[kCfgr], 12)) {  // OVRMOD
        registers_.at(kDr) = result;
    }
    flags_ |= 1U << kEndOfConversion | 1U << kEndOfSequence;
    if (on_result) {
        on_result(result);
    }
    if (by_dma && !is_set(flags_, kOverrun)) {  // after an overrun there are no more requests until the flag is cleared
        dma_.request(params_.request);
    }
    show_interrupt();
}

void Adc::check_watchdog(std::uint32_t result) {
    const std::uint32_t cfgr = registers_[kCfgr];
    const bool is_watched = is_set(cfgr, 23) && (!is_set(cfgr, 22) || field(cfgr, 26, 5) == channel());
    const bool oversamples = is_set(registers_[kCfgr2], 0);
    const std::uint32_t seen = oversamples ? result >> 4U : result;
    const std::uint32_t limits = registers_[kTr1];
    if (is_watched && (seen < field(limits, 0, 12) || seen > field(limits, 16, 12))) {
        flags_ |= 1U << kWatchdog1;
    }
}

void Adc::show_interrupt() { machine_.nvic.set_level(params_.interrupt, (flags_ & registers_[kIer]) != 0); }

void Adc::control(std::uint32_t value) {
    constexpr std::uint32_t kPowers = 1U << kRegulator | 1U << kDeepPowerDown;
    control_ = (control_ & ~kPowers) | (value & kPowers);
    if (!is_set(control_, kRegulator) || is_set(control_, kDeepPowerDown)) {
        regulated_from_.reset();
    } else if (!regulated_from_) {
        regulated_from_ = machine_.now() + ticks(kRegulatorStartS);
    }
    const bool powered = is_set(control_, kRegulator) && !is_set(control_, kDeepPowerDown);
    const std::uint32_t adc_hz_divider = common_.divider();
    if (is_set(value, kCalibrate)) {
        if (!powered || is_set(control_, kEnable)) {
            throw RunFailure("calibration requires the regulator to be on and the converter to be disabled");
        }
        if (machine_.now() < *regulated_from_) {
            throw RunFailure("calibration starts before the regulator is ready");
        }
        control_ |= 1U << kCalibrate;
        calibrated_.in(static_cast<Ticks>(kCalibrationCycles) * adc_hz_divider * machine_.cpu.ticks_per_cycle());
        return;
    }
    if (is_set(value, kEnable) && !is_set(control_, kEnable)) {
        if (!powered || is_set(control_, kCalibrate)) {
            throw RunFailure("converter is enabled without its regulator, or during calibration");
        }
        const double hz =
            static_cast<double>(kTicksPerSecond) / static_cast<double>(machine_.cpu.ticks_per_cycle()) / adc_hz_divider;
        if (hz > kMaxHz) {
            throw RunFailure("the converter clock is above 60 MHz");
        }
        control_ |= 1U << kEnable;
        ready_.in(ticks(kReadyS));
    }
    if (is_set(value, kDisable)) {
        control_ &= ~(1U << kEnable | 1U << kStart);
        converting_ = false;
    }
    if (is_set(value, kStart)) {
        if (!is_set(control_, kEnable) || !is_set(flags_, kReady)) {
            throw RunFailure("conversion starts before ADRDY");
        }
        if (field(registers_[kCfgr], 10, 2) != 1) {
            throw RunFailure("only conversions on a rising trigger edge are in this model");
        }
        if (field(registers_[kSqr1], 0, 4) != 0) {
            throw RunFailure("only sequences of one conversion are in this model");
        }
        if (is_set(registers_[kCfgr2], 0) && !is_set(registers_[kCfgr2], 9)) {
            throw RunFailure("oversampling without TROVS is not in this model");
        }
        control_ |= 1U << kStart;
        sum_ = 0;
        summed_ = 0;
    }
    if (is_set(value, kStop)) {
        control_ &= ~(1U << kStart);
        converting_ = false;
        converted_.reset();
    }
}

std::uint32_t Adc::read(std::uint32_t offset) {
    switch (offset) {
        case kIsr:
            return flags_;
        case kCr:
            return control_;
        case kDr:
            flags_ &= ~(1U << kEndOfConversion);
            return registers_[kDr];
        default:
            return registers_.at(offset);
    }
}

void Adc::write(std::uint32_t offset, std::uint32_t value) {
    const bool set_up = offset != kIsr && offset != kIer && offset != kCr && offset != kTr1;
    if (set_up && runs()) {
        throw RunFailure("register is written while conversions run");
    }
    switch (offset) {
        case kIsr:
            flags_ &= ~value;
            break;
        case kCr:
            control(value);
            break;
        case kDr:
            throw RunFailure("DR is read-only");
        default:
            registers_.at(offset) = value;
    }
    show_interrupt();
}

void Adc::reset() {
    registers_.reset();
    control_ = 1U << kDeepPowerDown;
    regulated_from_.reset();
    flags_ = 0;
    sum_ = 0;
    summed_ = 0;
    converting_ = false;
    converted_.reset();
    ready_.cancel();
    calibrated_.cancel();
}

}  // namespace tricoil::virtual_board

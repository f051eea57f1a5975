#include "sim/virtual_board/peripherals/rcc.hpp"

namespace tricoil::virtual_board {
namespace rcc {

constexpr std::uint32_t kCr = 0x00;
constexpr std::uint32_t kPllCfgr = 0x0C;
constexpr std::uint32_t kCier = 0x18;
constexpr std::uint32_t kCifr = 0x1C;
constexpr std::uint32_t kCicr = 0x20;
constexpr std::uint32_t kFirstReset = 0x28;
constexpr std::uint32_t kLastReset = 0x40;
constexpr std::uint32_t kEnablesFromResets = 0x20;
constexpr std::uint32_t kFirstInSleep = 0x68;  // AHB1SMENR
constexpr std::uint32_t kLastInSleep = 0x80;
constexpr std::uint32_t kBdcr = 0x90;
constexpr std::uint32_t kCrrcr = 0x98;

constexpr unsigned kHsiOn = 8;
constexpr unsigned kHsiReady = 10;
constexpr unsigned kHseOn = 16;
constexpr unsigned kHseReady = 17;
constexpr unsigned kSecurityOn = 19;
constexpr unsigned kPllOn = 24;
constexpr unsigned kPllReady = 25;
constexpr unsigned kSecurityFlag = 8;
constexpr unsigned kRemoveFlags = 23;
constexpr unsigned kBackupReset = 16;

constexpr double kHsiHz = 16e6;
constexpr double kHseHz = 24e6;  // the Nucleo's crystals
constexpr double kLseHz = 32'768;
constexpr double kLsiHz = 32e3;
constexpr double kCrystalStartS = 2e-3;  // DS12288, start-up times: HSE, LSE, LSI, HSI48, and PLL lock time
constexpr double kWatchCrystalStartS = 2;
constexpr double kSlowStartS = 130e-6;
constexpr double kHsi48StartS = 6e-6;
constexpr double kPllLockS = 40e-6;

constexpr int kLine = 5;  // interrupt of RCC
constexpr std::uint32_t kPllOutputs = 1U << 16U | 1U << 20U | 1U << 24U;
constexpr std::array<unsigned, 3> kPllEnables{16, 20, 24};  // PEN, QEN, REN

}  // namespace rcc

namespace {

enum Source : std::uint32_t { from_hsi = 1, from_hse = 2, from_pll = 3 };

std::vector<Register> rcc_registers() {
    return {
        {0x00, 0x500, "CR", 0x030B0700, "HSEBYP@18"},
        {0x04, 0x40000000, "ICSCR", 0x00FF0000, "HSITRIM@24-30"},
        {0x08, 0x5, "CFGR", 0x7F003FFF},
        {0x0C, 0x1000, "PLLCFGR", 0xFF737FF3},
        {0x18, 0, "CIER", 0x43B, "LSECSSIE@9"},
        {0x1C, 0, "CIFR", kAllBits},
        {0x20, 0, "CICR", kAllBits},
        {0x28, 0, "AHB1RSTR", kAllBits},
        {0x2C, 0, "AHB2RSTR", kAllBits},
        {0x30, 0, "AHB3RSTR", kAllBits},
        {0x38, 0, "APB1RSTR1", kAllBits},
        {0x3C, 0, "APB1RSTR2", kAllBits},
        {0x40, 0, "APB2RSTR", kAllBits},
        {0x48, 0x100, "AHB1ENR", kAllBits},
        {0x4C, 0, "AHB2ENR", kAllBits},
        {0x50, 0, "AHB3ENR", kAllBits},
        {0x58, 0x400, "APB1ENR1", kAllBits},
        {0x5C, 0, "APB1ENR2", kAllBits},
        {0x60, 0, "APB2ENR", kAllBits},
        {0x68, 0x130F, "AHB1SMENR", kAllBits},
        {0x6C, 0x050F667F, "AHB2SMENR", kAllBits},
        {0x70, 0x101, "AHB3SMENR", kAllBits},
        {0x78, 0xD2FECD3F, "APB1SMENR1", kAllBits},
        {0x7C, 0x103, "APB1SMENR2", kAllBits},
        {0x80, 0x0437F801, "APB2SMENR", kAllBits},
        {0x88, 0, "CCIPR", 0xFF000FFF, "I2C1SEL@12-13 I2C2SEL@14-15 I2C3SEL@16-17 LPTIM1SEL@18-19 SAI1SEL@20-21 I2S23SEL@22-23"},
        {0x90, 0, "BDCR", 0x0001001B, "LSEBYP@2 LSECSSON@5 LSECSSD@6 RTCSEL@8-9 RTCEN@15 LSCOEN@24 LSCOSEL@25"},
        {0x94, 0, "CSR", 0xFF800003},
        {0x98, 0, "CRRCR", 0xFF83},
        {0x9C, 0, "CCIPR2", 0, "I2C4SEL@0-1 QSPISEL@20-21"},
    };
}

}  // namespace

Rcc::Rcc(Machine& machine)
    : RegisterPeripheral(rcc_registers()),
      machine_(machine),
      crystal_ready_(machine.events, [this] { become_ready(rcc::kCr, rcc::kHseReady, 4); }),
      pll_ready_(machine.events, [this] { become_ready(rcc::kCr, rcc::kPllReady, 5); }),
      hsi48_ready_(machine.events, [this] { become_ready(rcc::kCrrcr, 1, 10); }),
      slow_ready_(
          machine.events, [this] { become_ready(kCsr, 1, 0); }, Event::Clock::always),
      watch_crystal_ready_(
          machine.events, [this] { become_ready(rcc::kBdcr, 1, 1); }, Event::Clock::always) {}

/// `interrupt`: position of the enable in CIER and of the flag in CIFR, which is set only if it is enabled.
void Rcc::become_ready(std::uint32_t control_register, unsigned ready_bit, unsigned interrupt) {
    registers_.at(control_register) |= 1U << ready_bit;
    ready_interrupts_ |= registers_[rcc::kCier] & 1U << interrupt;
    show_interrupt();
}

void Rcc::show_interrupt() { machine_.nvic.set_level(rcc::kLine, (ready_interrupts_ & registers_[rcc::kCier]) != 0); }

void Rcc::reset() {
    const std::uint32_t backup = registers_[rcc::kBdcr];  // keeps its content until a power failure
    registers_.reset();
    registers_.at(rcc::kBdcr) = backup;
    crystal_ready_.cancel();
    pll_ready_.cancel();
    hsi48_ready_.cancel();
    slow_ready_.cancel();
    security_interrupt_ = false;
    ready_interrupts_ = 0;
    show_interrupt();
    apply();
}

void Rcc::set_reset_cause(ResetCause cause) {
    const bool power = cause == ResetCause::power;
    causes_ = (power ? 0U : causes_) | 1U << static_cast<unsigned>(cause) | 1U << static_cast<unsigned>(ResetCause::pin);
    if (power) {
        registers_.at(rcc::kBdcr) = 0;
        watch_crystal_ready_.cancel();
    }
}

std::function<bool()> Rcc::clock(std::uint32_t enable_register, unsigned bit) const {
    return [this, enable_register, bit] { return is_set(registers_[enable_register], bit); };
}

double Rcc::crystal_hz() const { return is_set(registers_[rcc::kCr], rcc::kHseReady) ? rcc::kHseHz : 0; }

/// Frequency of the source that a field of CCIPR selects.
double Rcc::selected(unsigned position, const std::array<double, 4>& sources) const {
    return sources[field(registers_[kCcipr], position, 2)];
}

double Rcc::usb_hz() const { return selected(26, {is_set(registers_[rcc::kCrrcr], 1) ? 48e6 : 0, 0, pll_hz(PllOutput::q), 0}); }

double Rcc::pll_input_hz() const {
    return std::array{0.0, 0.0, rcc::kHsiHz, crystal_hz()}[field(registers_[rcc::kPllCfgr], 0, 2)];
}

double Rcc::pll_hz(PllOutput output) const {
    const std::uint32_t pll = registers_[rcc::kPllCfgr];
    if (!is_set(registers_[rcc::kCr], rcc::kPllReady) || !is_set(pll, rcc::kPllEnables[static_cast<std::size_t>(output)])) {
        return 0;
    }
    const double vco = pll_input_hz() / (field(pll, 4, 4) + 1) * field(pll, 8, 7);
    switch (output) {
        case PllOutput::p: {
            const std::uint32_t fine = field(pll, 27, 5);
            return vco / (fine >= 2 ? fine : is_set(pll, 17) ? 17 : 7);
        }
        case PllOutput::q:
            return vco / (2.0 * (field(pll, 21, 2) + 1));
        default:
            return vco / (2.0 * (field(pll, 25, 2) + 1));
    }
}

double Rcc::system_hz() const {
    return std::array{rcc::kHsiHz, rcc::kHsiHz, rcc::kHseHz, pll_hz(PllOutput::r)}[field(registers_[kCfgr], 0, 2)];
}

double Rcc::core_hz() const {
    static constexpr std::array<unsigned, 8> kShift{1, 2, 3, 4, 6, 7, 8, 9};
    const std::uint32_t divider = field(registers_[kCfgr], 4, 4);
    return system_hz() / (divider < 8 ? 1U : 1U << kShift[divider - 8]);
}

double Rcc::apb_hz(Apb bus) const {
    const std::uint32_t divider = field(registers_[kCfgr], bus == Apb::one ? 8 : 11, 3);
    return core_hz() / (divider < 4 ? 1U : 2U << (divider - 4));
}

Ticks Rcc::timer_ticks(Apb bus) const {
    const double hz = apb_hz(bus);
    return ticks_of_cycle(hz == core_hz() ? hz : 2 * hz);
}

Ticks Rcc::serial_ticks(unsigned position, Apb bus) const {
    return ticks_of_cycle(
        selected(position, {apb_hz(bus), system_hz(), is_set(registers_[rcc::kCr], rcc::kHsiOn) ? rcc::kHsiHz : 0,
                            is_set(registers_[rcc::kBdcr], 1) ? rcc::kLseHz : 0}));
}

Ticks Rcc::capture_ticks(unsigned input) const {
    const double lse_hz = is_set(registers_[rcc::kBdcr], 1) ? rcc::kLseHz : 0;
    const double lsi_hz = is_set(registers_[kCsr], 1) ? rcc::kLsiHz : 0;
    const double hz = std::array{0.0, -1.0, -1.0, crystal_hz() / 32, -1.0, lse_hz, lsi_hz, -1.0}[input];
    return hz < 0 ? -1 : ticks_of_cycle(hz);
}

double Rcc::fdcan_hz() const { return selected(24, {crystal_hz(), pll_hz(PllOutput::q), apb_hz(Apb::one), 0}); }

double Rcc::adc_hz(unsigned position) const { return selected(position, {0, pll_hz(PllOutput::p), system_hz(), 0}); }

void Rcc::apply() {
    const double hz = core_hz();
    check_frequency(hz);
    machine_.set_core_clock(ticks_of_cycle(hz));
    for (const auto& changed : on_change) {
        changed();
    }
}

/// The ready flag is one position above the enable bit.
void Rcc::start_oscillator(std::uint32_t control_register, unsigned enable_bit, Event& ready, double after_s) {
    if (!is_set(registers_[control_register], enable_bit)) {
        ready.cancel();
        registers_.at(control_register) &= ~(2U << enable_bit);
    } else if (!is_set(registers_[control_register], enable_bit + 1) && !ready.is_due()) {
        ready.in(ticks(after_s));
    }
}

void Rcc::check_pll() const {
    const double input = pll_input_hz() / (field(registers_[rcc::kPllCfgr], 4, 4) + 1);
    const double vco = input * field(registers_[rcc::kPllCfgr], 8, 7);
    // DS12288, PLL characteristics
    fail_if(input < 2.66e6 || input > 16e6 || vco < 96e6 || vco > 344e6, "PLL out of range: input {} Hz, VCO {} Hz", input, vco);
}

void Rcc::control(std::uint32_t value) {
    constexpr std::uint32_t kWritable =
        1U << rcc::kHsiOn | 1U << 9U | 1U << rcc::kHseOn | 1U << rcc::kSecurityOn | 1U << rcc::kPllOn;
    const std::uint32_t source = field(registers_[kCfgr], 2, 2);
    const bool pll_stops = !is_set(value, rcc::kPllOn);
    fail_if((source == from_pll && pll_stops) || (source == from_hsi && !is_set(value, rcc::kHsiOn)) ||
                (source == from_hse && !is_set(value, rcc::kHseOn)),
            "the source of the processor clock is switched off");
    registers_.at(rcc::kCr) = (registers_[rcc::kCr] & ~kWritable) | (value & kWritable);
    if (!is_set(value, rcc::kHsiOn)) {
        registers_.at(rcc::kCr) &= ~(1U << rcc::kHsiReady);
    } else if (!is_set(registers_[rcc::kCr], rcc::kHsiReady)) {
        become_ready(rcc::kCr, rcc::kHsiReady, 3);
    }
    if (crystal_works_) {
        start_oscillator(rcc::kCr, rcc::kHseOn, crystal_ready_, rcc::kCrystalStartS);
    }
    if (!pll_stops && !is_set(registers_[rcc::kCr], rcc::kPllReady)) {
        check_pll();
    }
    start_oscillator(rcc::kCr, rcc::kPllOn, pll_ready_, rcc::kPllLockS);
}

/// RM0440: source, multiplier and dividers are for a stopped PLL; the vendor's driver enables the outputs after PLLON.
void Rcc::write_pll(std::uint32_t value) {
    const std::uint32_t changed = value ^ registers_[rcc::kPllCfgr];
    fail_if(is_set(registers_[rcc::kCr], rcc::kPllOn) && (changed & ~rcc::kPllOutputs) != 0,
            "PLLCFGR is written while the PLL runs; only its outputs PEN, QEN, REN may change");
    fail_if(field(registers_[kCfgr], 2, 2) == from_pll && is_set(changed, rcc::kPllEnables[2]),
            "the PLL output that drives the processor is switched off (PLLCFGR.PLLREN)");
    registers_.at(rcc::kPllCfgr) = value;
}

void Rcc::write_backup(std::uint32_t value) {
    check_backup();
    const bool is_reset = is_set(value, rcc::kBackupReset);
    registers_.at(rcc::kBdcr) = is_reset ? 1U << rcc::kBackupReset : (value & ~2U) | (registers_[rcc::kBdcr] & 2U);
    start_oscillator(rcc::kBdcr, 0, watch_crystal_ready_, rcc::kWatchCrystalStartS);
}

void Rcc::reset_peripherals(std::uint32_t offset, std::uint32_t value) {
    const std::uint32_t rising = value & ~registers_[offset];
    registers_.at(offset) = value;
    for (unsigned bit = 0; bit < 32; ++bit) {
        if (is_set(rising, bit)) {
            on_peripheral_reset(offset + rcc::kEnablesFromResets, bit);
        }
    }
}

void Rcc::choose(std::uint32_t value) {
    const std::uint32_t source = field(value, 0, 2);
    const bool ready = source == from_hsi || (source == from_hse && is_set(registers_[rcc::kCr], rcc::kHseReady)) ||
                       (source == from_pll && pll_hz(PllOutput::r) > 0);
    fail_if(!ready, "clock source {} is selected before it is ready", source);
    registers_.at(kCfgr) = (value & ~0xCU) | source << 2U;
    apply();
}

void Rcc::leave_stop() {
    registers_.at(rcc::kCr) = (registers_[rcc::kCr] & ~(3U << rcc::kHseOn | 3U << rcc::kPllOn)) | 1U << rcc::kHsiOn | 1U << 10U;
    registers_.at(kCfgr) = (registers_[kCfgr] & ~0xFU) | from_hsi | from_hsi << 2U;
    crystal_ready_.cancel();
    pll_ready_.cancel();
    apply();
}

void Rcc::break_crystal() {
    crystal_works_ = false;
    crystal_ready_.cancel();
    const bool was_ready = is_set(registers_[rcc::kCr], rcc::kHseReady);
    registers_.at(rcc::kCr) &= ~(1U << rcc::kHseReady);
    if (!was_ready) {
        return;
    }
    const bool in_use = field(registers_[kCfgr], 2, 2) == from_hse ||
                        (field(registers_[kCfgr], 2, 2) == from_pll && field(registers_[rcc::kPllCfgr], 0, 2) == 3);
    fail_if(in_use && !is_set(registers_[rcc::kCr], rcc::kSecurityOn),
            "the crystal stops while the clock security system is off: the processor stops");
    if (in_use) {  // clock security system: back to HSI, with a non-maskable interrupt
        leave_stop();
        security_interrupt_ = true;
        machine_.nvic.pend(kNmi);
    }
}

std::uint32_t Rcc::read(std::uint32_t offset) {
    const std::uint32_t flags = flag(security_interrupt_, rcc::kSecurityFlag) | ready_interrupts_;
    return offset == rcc::kCifr ? flags : registers_.at(offset) | (offset == kCsr ? causes_ : 0);
}

void Rcc::apply(std::uint32_t offset, std::uint32_t value) {
    if (offset >= rcc::kFirstReset && offset <= rcc::kLastReset && registers_.has(offset)) {
        reset_peripherals(offset, value);
        return;
    }
    switch (offset) {
        case rcc::kCr:
            control(value);
            break;
        case kCfgr:
            choose(value);
            break;
        case rcc::kPllCfgr:
            write_pll(value);
            break;
        case rcc::kCicr:
            security_interrupt_ = security_interrupt_ && !is_set(value, rcc::kSecurityFlag);
            ready_interrupts_ &= ~value;
            show_interrupt();
            break;
        case rcc::kBdcr:
            write_backup(value);
            break;
        case kCsr:
            causes_ = is_set(value, rcc::kRemoveFlags) ? 0 : causes_;
            registers_.at(kCsr) = (registers_[kCsr] & 2U) | (value & 1U);
            start_oscillator(kCsr, 0, slow_ready_, rcc::kSlowStartS);
            break;
        case rcc::kCrrcr:
            registers_.at(rcc::kCrrcr) = (registers_[rcc::kCrrcr] & 2U) | (value & 1U);
            start_oscillator(rcc::kCrrcr, 0, hsi48_ready_, rcc::kHsi48StartS);
            break;
        default: {
            const bool stops = (registers_.at(offset) & ~value) != 0;
            registers_.at(offset) = value;
            show_interrupt();
            doubt_if(stops && offset >= rcc::kFirstInSleep && offset <= rcc::kLastInSleep,
                     "a clock is switched off in sleep mode (SMENR), where no clock stops in this model");
        }
    }
}

}  // namespace tricoil::virtual_board

#include "sim/virtual_board/peripherals/rcc.hpp"

#include <fmt/format.h>

#include <array>

namespace tricoil::virtual_board {
namespace {

constexpr std::uint32_t kCr = 0x00;
constexpr std::uint32_t kCfgr = 0x08;
constexpr std::uint32_t kPllCfgr = 0x0C;
constexpr std::uint32_t kCifr = 0x1C;
constexpr std::uint32_t kCicr = 0x20;
constexpr std::uint32_t kCsr = 0x94;
constexpr std::uint32_t kCrrcr = 0x98;

constexpr unsigned kHsiOn = 8;
constexpr unsigned kHseOn = 16;
constexpr unsigned kHseReady = 17;
constexpr unsigned kSecurityOn = 19;
constexpr unsigned kPllOn = 24;
constexpr unsigned kPllReady = 25;
constexpr unsigned kSecurityFlag = 8;
constexpr unsigned kRemoveFlags = 23;

constexpr double kHsiHz = 16e6;
constexpr double kHseHz = 24e6;          // the Nucleo's crystal
constexpr double kCrystalStartS = 2e-3;  // DS12288, HSE oscillator start-up time
constexpr double kPllLockS = 40e-6;      // DS12288, PLL lock time
constexpr double kHsi48StartS = 6e-6;    // DS12288, HSI48 start-up time

enum Source : std::uint32_t { from_hsi = 1, from_hse = 2, from_pll = 3 };

}  // namespace

Rcc::Rcc(Machine& machine)
    : machine_(machine),
      registers_{{kCr, 0x500}, {0x04, 0x40000000}, {kCfgr, 0x5}, {kPllCfgr, 0x1000}, {0x18, 0},      {kCifr, 0},
                 {kCicr, 0},   {kAhb1, 0x100},     {kAhb2, 0},   {0x50, 0},          {kApb1, 0x400}, {0x5C, 0},
                 {kApb2, 0},   {kCcipr, 0},        {0x90, 0},    {kCsr, 0},          {kCrrcr, 0}},
      crystal_ready_(machine.events, [this] { registers_.at(kCr) |= 1U << kHseReady; }),
      pll_ready_(machine.events, [this] { registers_.at(kCr) |= 1U << kPllReady; }),
      hsi48_ready_(machine.events, [this] { registers_.at(kCrrcr) |= 2U; }) {}

void Rcc::reset() {
    registers_.reset();
    crystal_ready_.cancel();
    pll_ready_.cancel();
    hsi48_ready_.cancel();
    security_interrupt_ = false;
    apply();
}

void Rcc::set_reset_cause(ResetCause cause) {
    const bool power = cause == ResetCause::power;
    causes_ = (power ? 0U : causes_) | 1U << static_cast<unsigned>(cause) | 1U << static_cast<unsigned>(ResetCause::pin);
}

std::function<bool()> Rcc::clock(std::uint32_t enable_register, unsigned bit) const {
    return [this, enable_register, bit] { return is_set(registers_[enable_register], bit); };
}

bool Rcc::has_48_mhz() const { return is_set(registers_[kCrrcr], 1) && field(registers_[kCcipr], 26, 2) == 0; }

double Rcc::pll_input_hz() const {
    switch (field(registers_[kPllCfgr], 0, 2)) {
        case 2:
            return kHsiHz;
        case 3:
            return is_set(registers_[kCr], kHseReady) ? kHseHz : 0;
        default:
            return 0;
    }
}

double Rcc::system_hz() const {
    const std::uint32_t pll = registers_[kPllCfgr];
    switch (field(registers_[kCfgr], 0, 2)) {
        case from_hse:
            return kHseHz;
        case from_pll: {
            const double input = pll_input_hz() / (field(pll, 4, 4) + 1);
            return input * field(pll, 8, 7) / (2.0 * (field(pll, 25, 2) + 1));
        }
        default:
            return kHsiHz;
    }
}

double Rcc::core_hz() const {
    static constexpr std::array<unsigned, 8> kShift{1, 2, 3, 4, 6, 7, 8, 9};
    const std::uint32_t divider = field(registers_[kCfgr], 4, 4);
    return system_hz() / (divider < 8 ? 1U : 1U << kShift[divider - 8]);
}

void Rcc::apply() {
    const double hz = core_hz();
    if (check_frequency) {
        check_frequency(hz);
    }
    const double ticks = static_cast<double>(kTicksPerSecond) / hz;
    if (ticks != static_cast<double>(static_cast<Ticks>(ticks))) {
        throw RunFailure(fmt::format("a cycle of a core clock of {} Hz is not a whole number of ticks in this model", hz));
    }
    machine_.cpu.set_ticks_per_cycle(static_cast<Ticks>(ticks));
}

void Rcc::start_oscillator(unsigned enable_bit, Event& ready, double after_s) {
    if (!is_set(registers_[kCr], enable_bit)) {
        ready.cancel();
        registers_.at(kCr) &= ~(2U << enable_bit);
    } else if (!is_set(registers_[kCr], enable_bit + 1) && !ready.is_due()) {
        ready.in(ticks(after_s));
    }
}

void Rcc::control(std::uint32_t value) {
    constexpr std::uint32_t kWritable = 1U << kHsiOn | 1U << 9U | 1U << kHseOn | 1U << 18U | 1U << kSecurityOn | 1U << kPllOn;
    const std::uint32_t source = field(registers_[kCfgr], 2, 2);
    if ((source == from_pll && !is_set(value, kPllOn)) || (source == from_hsi && !is_set(value, kHsiOn))) {
        throw RunFailure("the source of the processor clock is switched off");
    }
    registers_.at(kCr) = (registers_[kCr] & ~kWritable) | (value & kWritable);
    registers_.at(kCr) = (registers_[kCr] & ~(1U << 10U)) | flag(is_set(value, kHsiOn), 10);
    if (crystal_works_) {
        start_oscillator(kHseOn, crystal_ready_, kCrystalStartS);
    }
    if (is_set(value, kPllOn) && !is_set(registers_[kCr], kPllReady)) {
        const double input = pll_input_hz() / (field(registers_[kPllCfgr], 4, 4) + 1);
        const double vco = input * field(registers_[kPllCfgr], 8, 7);
        if (input < 2.66e6 || input > 16e6 || vco < 96e6 || vco > 344e6) {  // DS12288, PLL characteristics
            throw RunFailure(fmt::format("PLL out of range: input {} Hz, VCO {} Hz", input, vco));
        }
    }
    start_oscillator(kPllOn, pll_ready_, kPllLockS);
}

void Rcc::choose(std::uint32_t value) {
    const std::uint32_t source = field(value, 0, 2);
    const bool ready = source == from_hsi || (source == from_hse && is_set(registers_[kCr], kHseReady)) ||
                       (source == from_pll && is_set(registers_[kCr], kPllReady) && is_set(registers_[kPllCfgr], 24));
    if (!ready) {
        throw RunFailure(fmt::format("clock source {} is selected before it is ready", source));
    }
    if (field(value, 8, 6) != 0) {
        throw RunFailure("dividers of the peripheral clocks are not in this model");
    }
    registers_.at(kCfgr) = (value & ~0xCU) | source << 2U;
    apply();
}

void Rcc::break_crystal() {
    crystal_works_ = false;
    crystal_ready_.cancel();
    const bool was_ready = is_set(registers_[kCr], kHseReady);
    registers_.at(kCr) &= ~(1U << kHseReady);
    if (!was_ready) {
        return;
    }
    const bool in_use = field(registers_[kCfgr], 2, 2) == from_hse ||
                        (field(registers_[kCfgr], 2, 2) == from_pll && field(registers_[kPllCfgr], 0, 2) == 3);
    if (in_use && !is_set(registers_[kCr], kSecurityOn)) {
        throw RunFailure("the crystal stops while the clock security system is off: the processor stops");
    }
    if (in_use) {  // clock security system: back to HSI, with a non-maskable interrupt
        registers_.at(kCr) &= ~(1U << kHseOn | 1U << kPllOn | 1U << kPllReady);
        registers_.at(kCfgr) = (registers_[kCfgr] & ~0xFU) | from_hsi | from_hsi << 2U;
        apply();
        security_interrupt_ = true;
        machine_.nvic.pend(kNmi);
    }
}

void Rcc::start_hsi48(bool on) {
    if (on && !is_set(registers_[kCrrcr], 0)) {
        registers_.at(kCrrcr) = 1;
        hsi48_ready_.in(ticks(kHsi48StartS));
    } else if (!on) {
        registers_.at(kCrrcr) = 0;
        hsi48_ready_.cancel();
    }
}

std::uint32_t Rcc::read(std::uint32_t offset) {
    switch (offset) {
        case kCifr:
            return flag(security_interrupt_, kSecurityFlag);
        case kCsr:
            return registers_[kCsr] | flag(is_set(registers_[kCsr], 0), 1) | causes_;
        default:
            return registers_.at(offset);
    }
}

void Rcc::write(std::uint32_t offset, std::uint32_t value) {
    switch (offset) {
        case kCr:
            control(value);
            break;
        case kCfgr:
            choose(value);
            break;
        case kPllCfgr:
            if (is_set(registers_[kCr], kPllOn)) {
                throw RunFailure("PLLCFGR is written while the PLL runs");
            }
            registers_.at(kPllCfgr) = value;
            break;
        case kCicr:
            security_interrupt_ = security_interrupt_ && !is_set(value, kSecurityFlag);
            break;
        case kCsr:
            causes_ = is_set(value, kRemoveFlags) ? 0 : causes_;
            registers_.at(kCsr) = value & 1U;
            break;
        case kCrrcr:
            start_hsi48(is_set(value, 0));
            break;
        default:
            registers_.at(offset) = value;
    }
}

}  // namespace tricoil::virtual_board

#include "sim/virtual_board/peripherals/pwr.hpp"

namespace tricoil::virtual_board {
namespace pwr {

constexpr std::uint32_t kCr4 = 0x0C;
constexpr std::uint32_t kSr1 = 0x10;
constexpr std::uint32_t kSr2 = 0x14;
constexpr std::uint32_t kScr = 0x18;
constexpr unsigned kLowPowerRun = 14;
constexpr unsigned kLowPowerRegulator = 9;
constexpr unsigned kVoltageChanges = 10;
constexpr double kSettleS = 20e-6;  // DS12288, time between voltage scalings; maximum
constexpr std::uint32_t kFlags = 0x11F;

}  // namespace pwr

Pwr::Pwr(Machine& machine)
    : RegisterPeripheral({{kCr1, 0x200, "CR1", 0x4707},
                          {0x04, 0, "CR2", 0x1F, "PVME1@4 PVME2@5 PVME3@6 PVME4@7"},
                          {kCr3, 0x8000, "CR3", 0xE01F, "RRS@8 APC@10"},
                          {pwr::kCr4, 0, "CR4", 0x1F, "VBE@8 VBRS@9"},
                          {pwr::kSr1, 0, "SR1", kAllBits},
                          {pwr::kSr2, 0, "SR2", kAllBits},
                          {pwr::kScr, 0, "SCR", kAllBits},
                          {kCr5, 0x100, "CR5", 0x100}}),
      settled_(machine.events, [] {}) {}

Pwr::Range Pwr::range() const {
    if (is_set(registers_[kCr1], pwr::kLowPowerRun)) {
        return Range::low_power_run;
    }
    if (field(registers_[kCr1], 9, 2) != 1) {
        return Range::low;
    }
    return !is_set(registers_[kCr5], 8) && !settled_.is_due() ? Range::boost : Range::normal;
}

Pwr::DeepSleep Pwr::deep_sleep() const {
    const std::uint32_t mode = field(registers_[kCr1], 0, 3);
    return mode < 2 ? DeepSleep::stop : mode == 3 ? DeepSleep::standby : DeepSleep::shutdown;
}

void Pwr::set_wake_pin(unsigned number, bool high) {
    const unsigned bit = number - 1;
    const bool changes = is_set(pins_, bit) != high;
    pins_ = (pins_ & ~(1U << bit)) | flag(high, bit);
    const bool wanted_edge = high != is_set(registers_[pwr::kCr4], bit);
    if (changes && wanted_edge && is_set(registers_[kCr3], bit)) {
        status_ |= 1U << bit;
        on_wake_pin();
    }
}

std::uint32_t Pwr::read(std::uint32_t offset) {
    switch (offset) {
        case pwr::kSr1:
            return status_;
        case pwr::kSr2:
            return flag(settled_.is_due(), pwr::kVoltageChanges) | flag(range() == Range::low_power_run, pwr::kLowPowerRegulator);
        default:
            return registers_.at(offset);
    }
}

void Pwr::apply(std::uint32_t offset, std::uint32_t value) {
    if (offset == pwr::kScr) {
        status_ &= ~(value & pwr::kFlags);
        return;
    }
    const std::uint32_t voltage = field(value, 9, 2);
    fail_if(offset == kCr1 && (voltage == 0 || voltage == 3), "CR1: VOS must be 1 (range 1) or 2 (range 2)");
    const bool changes_voltage = (offset == kCr5 && ((value ^ registers_[kCr5]) & 0x100U) != 0) ||
                                 (offset == kCr1 && ((value ^ registers_[kCr1]) & 0x600U) != 0);
    registers_.at(offset) = value;
    if (changes_voltage) {
        settled_.in(ticks(pwr::kSettleS));
    }
    if (offset == kCr1 || offset == kCr5) {
        check_frequency();
    }
}

void Pwr::reset() {
    registers_.reset();
    settled_.cancel();
}

}  // namespace tricoil::virtual_board

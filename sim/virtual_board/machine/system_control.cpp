#include "sim/virtual_board/machine/system_control.hpp"

#include <array>

namespace tricoil::virtual_board {
namespace {

// Offsets from 0xE000ED00.
constexpr std::uint32_t kCpuid = 0x00;
constexpr std::uint32_t kIcsr = 0x04;
constexpr std::uint32_t kAircr = 0x0C;
constexpr std::uint32_t kPriorities = 0x18;  // of exceptions 4 to 15, one byte each
constexpr std::uint32_t kShcsr = 0x24;
constexpr std::uint32_t kCfsr = 0x28;
constexpr std::uint32_t kHfsr = 0x2C;
constexpr std::uint32_t kMmfar = 0x34;
constexpr std::uint32_t kBfar = 0x38;
constexpr std::uint32_t kDhcsr = 0xF0;
constexpr std::uint32_t kDemcr = 0xFC;

constexpr std::uint32_t kPriorityBytes = 12;
constexpr unsigned kFaultEnables = 16;  // MEMFAULTENA; BUSFAULTENA and USGFAULTENA follow
constexpr std::uint32_t kSystemResetRequest = 1U << 2U;
constexpr std::uint32_t kForced = 1U << 30U;             // HFSR
constexpr std::uint32_t kMemoryAddressValid = 1U << 7U;  // CFSR.MMARVALID
constexpr std::uint32_t kBusAddressValid = 1U << 15U;    // CFSR.BFARVALID

}  // namespace

SystemControl::SystemControl(Nvic& nvic, std::function<void()> request_reset)
    : nvic_(nvic),
      request_reset_(std::move(request_reset)),
      registers_({{kCpuid, 0x410FC241, "CPUID", 0},  // Cortex-M4 r0p1
                  {kIcsr, 0, "ICSR", kAllBits},
                  {kVtor, 0, "VTOR", 0xFFFFFF80},
                  {kAircr, 0xFA050000, "AIRCR", 0xFFFF0704},
                  {kScr, 0, "SCR", 0x16},
                  {kCcr, 0x200, "CCR", 0x218, "NONBASETHRDENA@0 USERSETMPEND@1 BFHFNMIGN@8"},
                  {kPriorities, 0, "SHPR1", 0xF0F0F0},
                  {kPriorities + 4, 0, "SHPR2", 0xF0000000},
                  {kPriorities + 8, 0, "SHPR3", 0xF0F00000},
                  {kShcsr, 0, "SHCSR", 7U << kFaultEnables, "active_and_pending_flags@0-15"},
                  {kCfsr, 0, "CFSR", kAllBits},
                  {kHfsr, 0, "HFSR", kAllBits},
                  {kMmfar, 0, "MMFAR", 0},
                  {kBfar, 0, "BFAR", 0},
                  {kCpacr, 0, "CPACR", 0x00F00000},
                  kMpuRegisters[0],
                  kMpuRegisters[1],
                  kMpuRegisters[2],
                  kMpuRegisters[3],
                  kMpuRegisters[4],
                  {kDemcr, 1U << 24U, "DEMCR", 0x01000000},
                  {kFpccr, 0xC0000000, "FPCCR", kAllBits},
                  {kFpcar, 0, "FPCAR", 0xFFFFFFF8},
                  {kFpdscr, 0, "FPDSCR", 0x07C00000}}) {}

int SystemControl::note_fault(std::uint32_t bits, std::uint32_t address) {
    registers_.at(kCfsr) |= bits;
    if ((bits & kMemoryAddressValid) != 0) {
        registers_.at(kMmfar) = address;
    }
    if ((bits & kBusAddressValid) != 0) {
        registers_.at(kBfar) = address;
    }
    const unsigned own = bits >= kUndefined ? 2 : bits >= kFetchError ? 1 : 0;
    return is_set(registers_[kShcsr], kFaultEnables + own) ? kMemManage + static_cast<int>(own) : kHardFault;
}

void SystemControl::escalate_fault() { registers_.at(kHfsr) |= kForced; }

void SystemControl::wait_for_lazy_save(std::uint32_t address) {
    registers_.at(kFpcar) = address;
    registers_.at(kFpccr) |= 1U;
}

std::uint32_t SystemControl::interrupt_state() const {
    return static_cast<std::uint32_t>(running_) | flag(nvic_.active_count() <= 1, 11) |
           static_cast<std::uint32_t>(nvic_.first_pending()) << 12U | flag(nvic_.first_pending() >= kFirstInterrupt, 22) |
           flag(nvic_.is_pending(kSysTick), 26) | flag(nvic_.is_pending(kPendSv), 28) | flag(nvic_.is_pending(kNmi), 31);
}

void SystemControl::control_interrupts(std::uint32_t value) {
    const auto set_pending = [&](unsigned at, int exception, bool pends) {
        if ((value >> at & 1U) != 0) {
            pends ? nvic_.pend(exception) : nvic_.unpend(exception);
        }
    };
    set_pending(31, kNmi, true);
    set_pending(28, kPendSv, true);
    set_pending(27, kPendSv, false);
    set_pending(26, kSysTick, true);
    set_pending(25, kSysTick, false);
}

std::uint32_t SystemControl::read(std::uint32_t offset) {
    if (offset >= kPriorities && offset < kPriorities + kPriorityBytes) {
        std::uint32_t value = 0;
        for (unsigned byte = 0; byte < 4; ++byte) {
            const int exception = static_cast<int>(4 + offset - kPriorities + byte);
            value |= static_cast<std::uint32_t>(nvic_.priority(exception)) << 8U * byte;
        }
        return value;
    }
    if (offset >= Mpu::kFirst && offset <= Mpu::kLast) {
        return mpu_.read(offset);
    }
    if (offset == kIcsr || offset == kAircr) {
        return offset == kIcsr ? interrupt_state() : 0xFA050000U | nvic_.group() << 8U;
    }
    return offset == kDhcsr ? 0 : registers_.at(offset);  // no debugger is attached
}

void SystemControl::write(std::uint32_t offset, std::uint32_t value) {
    if (offset >= kPriorities && offset < kPriorities + kPriorityBytes) {
        write_narrow(offset, value, 4);
        return;
    }
    if (offset >= Mpu::kFirst && offset <= Mpu::kLast) {
        mpu_.write(offset, value);
        return;
    }
    switch (offset) {
        case kIcsr:
            control_interrupts(value);
            break;
        case kAircr:
            fail_if(value >> 16U != 0x05FA, "AIRCR is written without its key");
            nvic_.set_group(value >> 8U & 7U);
            if ((value & kSystemResetRequest) != 0) {
                request_reset_();
            }
            break;
        case kScr:
        case kCcr:
        case kShcsr:
            registers_.check(offset, value);
            registers_.at(offset) = value;
            break;
        case kCfsr:
        case kHfsr:
            registers_.at(offset) &= ~value;
            break;
        case kVtor:
        case kCpacr:
        case kFpccr:
        case kFpcar:
        case kFpdscr:  // the other bits stay zero
            registers_.at(offset) = value & registers_.modelled(offset);
            break;
        case kDemcr:
            break;
        default:
            throw RunFailure("no such register, or the register is read-only");
    }
}

void SystemControl::write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) {
    for (unsigned byte = 0; byte < bytes; ++byte) {
        const std::uint32_t at = offset + byte - kPriorities;
        fail_if(offset < kPriorities || at >= kPriorityBytes, "byte write to a 4-byte register");
        nvic_.set_priority(static_cast<int>(4 + at), static_cast<std::uint8_t>(value >> 8U * byte));
    }
}

void SystemControl::reset() {
    registers_.reset();
    mpu_.reset();
    running_ = 0;
}

SysTick::SysTick(Events& events, Nvic& nvic, std::function<Ticks()> ticks_per_cycle)
    : RegisterPeripheral({{kControl, 0, "CTRL", 0x10007},
                          {kLoad, 0, "LOAD", kAllBits},
                          {kValue, 0, "VAL", kAllBits},
                          {0xC, 0, "CALIB", kAllBits}}),
      events_(events),
      nvic_(nvic),
      ticks_per_cycle_(std::move(ticks_per_cycle)),
      wrap_(events, [this] { wrap(); }) {}

void SysTick::wrap() {
    counted_ = true;
    if (is_set(registers_[kControl], 1)) {
        nvic_.pend(kSysTick);
    }
    start();
}

void SysTick::start() {
    if (is_set(registers_[kControl], 0) && registers_[kLoad] != 0) {
        wrap_.in((Ticks{registers_[kLoad]} + 1) * ticks_per_count());
    } else {
        wrap_.cancel();
    }
}

std::uint32_t SysTick::count() const {
    return wrap_.is_due() ? static_cast<std::uint32_t>((wrap_.when() - events_.now()) / ticks_per_count()) : 0;
}

void SysTick::count_from(std::uint32_t count) {
    if (wrap_.is_due()) {
        wrap_.in(Ticks{count} * ticks_per_count());
    }
}

std::uint32_t SysTick::read(std::uint32_t offset) {
    const std::uint32_t word = registers_.at(offset);
    return offset == kControl ? word | flag(std::exchange(counted_, false), 16) : offset == kValue ? count() : word;
}

void SysTick::apply(std::uint32_t offset, std::uint32_t value) {
    const std::uint32_t changed = registers_.at(offset) ^ value;
    if (offset == kControl || offset == kLoad) {
        registers_.at(offset) = value & (offset == kLoad ? 0xFFFFFFU : 7U);
    }
    counted_ = counted_ && offset != kValue;
    if (offset == kValue || (offset == kControl && (changed & 5U) != 0)) {
        start();
    }
}

void SysTick::reset() {
    registers_.reset();
    counted_ = false;
    wrap_.cancel();
}

std::uint32_t CycleCounter::read(std::uint32_t offset) {
    const bool counts = offset == kCount && is_set(registers_[kControl], 0);
    return counts ? static_cast<std::uint32_t>(cycles_ - zero_) : registers_.at(offset);
}

void CycleCounter::apply(std::uint32_t offset, std::uint32_t value) {
    registers_.at(kCount) = offset == kCount ? value : read(kCount);
    zero_ = cycles_ - registers_[kCount];
    registers_.at(kControl) = offset == kControl ? (value & 1U) | 0x40000000U : registers_[kControl];
    fail_if(!registers_.has(offset), "no such register");
}

}  // namespace tricoil::virtual_board

// Exceptions of the processor: stacking, entry, tail chaining, return, and lazy saving of floating-point registers
// (ARMv7-M B1.5).
#include <unicorn/unicorn.h>

#include <array>
#include <cstring>
#include <utility>

#include "sim/virtual_board/machine/cpu.hpp"
#include "sim/virtual_board/machine/run_failure.hpp"

namespace tricoil::virtual_board {
namespace {

constexpr std::uint32_t kBasicFrame = 0x20;
constexpr std::uint32_t kFloatFrame = 0x68;
constexpr std::uint32_t kPadded = 1U << 9U;
constexpr std::uint32_t kExcReturn = 0xFFFFFFE1;  // EXC_RETURN: handler mode, main stack, floating-point frame
constexpr std::uint32_t kToThread = 8;
constexpr std::uint32_t kToProcessStack = 4;
constexpr std::uint32_t kWithoutFloat = 0x10;
constexpr std::uint32_t kProcessStack = 2;  // CONTROL.SPSEL
constexpr std::uint32_t kFloatContext = 4;  // CONTROL.FPCA
constexpr std::array<int, 6> kFrameRegisters{UC_ARM_REG_R0, UC_ARM_REG_R1,  UC_ARM_REG_R2,
                                             UC_ARM_REG_R3, UC_ARM_REG_R12, UC_ARM_REG_LR};

}  // namespace

void Cpu::use_float(std::uint32_t address) {
    fail_if(!control_.float_is_on(), "floating-point instruction at {:#010x} before CPACR enables it", address);
    if (control_.lazy_save_waits()) {
        save_float(control_.lazy_save_address());
        control_.end_lazy_save();
    }
    if (!float_context_ && control_.saves_float()) {
        sync_float_context(true);
        set(UC_ARM_REG_FPSCR, control_.default_fpscr());
    }
}

void Cpu::save_float(std::uint32_t address) {
    for (std::uint32_t n = 0; n < 16; ++n) {
        store(address + 4 * n, get(UC_ARM_REG_S0 + static_cast<int>(n)));
    }
    store(address + 64, get(UC_ARM_REG_FPSCR));
}

void Cpu::sync_float_context(bool active) {
    float_context_ = active;
    const std::uint32_t control = get(UC_ARM_REG_CONTROL);
    set(UC_ARM_REG_CONTROL, active ? control | kFloatContext : control & ~kFloatContext);
}

void Cpu::store(std::uint32_t address, std::uint32_t word) {
    const auto bytes = memory_.at(address, 4);
    fail_if(bytes.empty() || address < Memory::kCcmBase || (address >= Memory::kSystemBase && address < Memory::kRamBase),
            "stack pointer {:#010x} is outside RAM on entering an exception", address);
    std::memcpy(bytes.data(), &word, sizeof word);
}

std::uint32_t Cpu::load(std::uint32_t address) {
    const auto bytes = memory_.at(address, 4);
    fail_if(bytes.empty(), "stack pointer {:#010x} is outside memory on leaving an exception", address);
    std::uint32_t word = 0;
    std::memcpy(&word, bytes.data(), sizeof word);
    return word;
}

void Cpu::stack_frame() {
    const bool with_float = float_context_ && control_.saves_float();
    const std::uint32_t size = with_float ? kFloatFrame : kBasicFrame;
    const std::uint32_t before = get(UC_ARM_REG_SP);
    const bool pads = control_.stack_aligned() && ((before - size) & 4U) != 0;
    const std::uint32_t frame = before - size - (pads ? 4 : 0);
    push_frame(frame, (get(UC_ARM_REG_XPSR) & ~kPadded) | (pads ? kPadded : 0) | kThumb);
    if (with_float && control_.saves_lazily()) {
        control_.wait_for_lazy_save(frame + kBasicFrame);
    } else if (with_float) {
        save_float(frame + kBasicFrame);
    }
    const bool process_stack = running_ == 0 && (get(UC_ARM_REG_CONTROL) & kProcessStack) != 0;
    set(UC_ARM_REG_SP, frame);
    const std::uint32_t exc_return =
        kExcReturn | (running_ == 0 ? kToThread : 0) | (process_stack ? kToProcessStack : 0) | (with_float ? 0 : kWithoutFloat);
    add_cycles(kEntryCycles);
    events_.advance(
        events_.now());  // late arrival: a more urgent exception that becomes pending up to this point is entered first
    enter(false, exc_return);
}

/// While a fault becomes an exception, a frame outside RAM is itself a fault, which joins the first one (ARMv7-M B1.5.15).
void Cpu::push_frame(std::uint32_t frame, std::uint32_t xpsr) {
    const bool in_fault = std::exchange(takes_fault_, takes_fault_ && !fault_) && fault_;
    fault_.reset();
    if (in_fault && !Memory::is_ram(frame)) {
        const bool forbidden = control_.mpu().forbids(frame, false);
        (void)control_.note_fault(forbidden ? SystemControl::kForbiddenStacking : SystemControl::kStackingError, 0);
        return;
    }
    for (std::uint32_t n = 0; n < kFrameRegisters.size(); ++n) {
        store(frame + 4 * n, get(kFrameRegisters[n]));
    }
    store(frame + 0x18, pc());
    store(frame + 0x1C, xpsr);
}

/// Makes the fault a pending exception: its own if that is enabled and urgent enough, otherwise HardFault.
void Cpu::take_fault() {
    const std::uint32_t address = fault_->address;
    const bool is_fetch = fault_->kind == Fault::Kind::fetch;
    const bool forbidden = fault_->kind != Fault::Kind::instruction && control_.mpu().forbids(address, is_fetch);
    failure_.reset();
    fail_if(nvic_.is_active(kHardFault) || nvic_.is_active(kNmi), "fault in the handler of a fault: the processor locks up");
    const std::uint32_t on_data = forbidden ? SystemControl::kForbiddenData : SystemControl::kDataBusError;
    const std::uint32_t on_fetch = forbidden ? SystemControl::kForbiddenFetch : SystemControl::kFetchError;
    const bool undefined = fault_->kind == Fault::Kind::instruction;
    const int exception = control_.note_fault(undefined ? SystemControl::kUndefined : is_fetch ? on_fetch : on_data, address);
    nvic_.pend(exception);
    if (exception == kHardFault || nvic_.to_take(masks()) != exception) {
        nvic_.unpend(exception);
        nvic_.pend(kHardFault);
        control_.escalate_fault();
    }
}

void Cpu::enter(bool tail_chained, std::uint32_t exc_return) {
    const int exception = nvic_.to_take(masks());
    if (tail_chained) {
        add_cycles(kTailChainCycles);
    }
    nvic_.enter(exception);
    event_ = true;
    running_ = exception;
    control_.set_running(exception);
    set(UC_ARM_REG_XPSR, kThumb | static_cast<std::uint32_t>(exception));  // selects the main stack
    sync_float_context(false);
    set(UC_ARM_REG_LR, exc_return);
    const std::uint32_t vector = memory_.word(control_.vector_table() + 4 * static_cast<std::uint32_t>(exception));
    fail_if((vector & 1U) == 0 || memory_.at(vector & ~1U, 2).empty(), "exception {} (interrupt {}) has no handler", exception,
            exception - kFirstInterrupt);
    set(UC_ARM_REG_PC, vector);
}

void Cpu::leave(std::uint32_t exc_return) {
    fail_if(running_ == 0, "exception return {:#010x} outside an exception", exc_return);
    nvic_.leave(running_);
    if (nvic_.may_take() && nvic_.to_take(masks()) != 0) {
        enter(true, exc_return);
        return;
    }
    unstack_frame(exc_return);
    add_cycles(kReturnCycles);
}

void Cpu::unstack_frame(std::uint32_t exc_return) {
    const bool to_thread = (exc_return & kToThread) != 0;
    const bool process_stack = (exc_return & kToProcessStack) != 0;
    const bool with_float = (exc_return & kWithoutFloat) == 0;
    fail_if(to_thread != (nvic_.active_count() == 0) || (process_stack && !to_thread),
            "exception return {:#010x} does not match the {} active exceptions", exc_return, nvic_.active_count());
    const std::uint32_t frame = get(process_stack ? UC_ARM_REG_PSP : UC_ARM_REG_MSP);
    for (std::uint32_t n = 0; n < kFrameRegisters.size(); ++n) {
        set(kFrameRegisters[n], load(frame + 4 * n));
    }
    const std::uint32_t pc = load(frame + 0x18);
    const std::uint32_t xpsr = load(frame + 0x1C);
    if (with_float && control_.lazy_save_waits()) {
        control_.end_lazy_save();  // the registers are unchanged
    } else if (with_float) {
        for (std::uint32_t n = 0; n < 16; ++n) {
            set(UC_ARM_REG_S0 + static_cast<int>(n), load(frame + kBasicFrame + 4 * n));
        }
        set(UC_ARM_REG_FPSCR, load(frame + kBasicFrame + 64));
    }
    const std::uint32_t after = frame + (with_float ? kFloatFrame : kBasicFrame) + ((xpsr & kPadded) != 0 ? 4 : 0);
    set(process_stack ? UC_ARM_REG_PSP : UC_ARM_REG_MSP, after);
    set(UC_ARM_REG_XPSR_NZCVQG, xpsr & ~kPadded);
    running_ = static_cast<int>(xpsr & 0x1FFU);
    control_.set_running(running_);
    if (to_thread) {
        const std::uint32_t control = get(UC_ARM_REG_CONTROL);
        set(UC_ARM_REG_CONTROL, process_stack ? control | kProcessStack : control & ~kProcessStack);
    }
    sync_float_context(with_float);
    set(UC_ARM_REG_PC, pc | 1U);
    event_ = true;
    if (to_thread && control_.sleeps_on_exit()) {
        start_sleep(false);
    }
}

void Cpu::take_exceptions() {
    if (exception_return_) {
        const std::uint32_t exc_return = *exception_return_;
        exception_return_.reset();
        leave(exc_return);
    }
    if (nvic_.may_take() && nvic_.to_take(masks()) != 0) {
        stack_frame();
    }
}

}  // namespace tricoil::virtual_board

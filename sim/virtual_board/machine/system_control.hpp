// Registers of the processor's private bus: system control block, SysTick, floating-point context, cycle counter.
#pragma once

#include <array>
#include <functional>

#include "sim/virtual_board/machine/mpu.hpp"
#include "sim/virtual_board/machine/nvic.hpp"
#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

/// System control block and floating-point context registers, 0xE000ED00-0xE000EFFF (ARMv7-M B3.2).
class SystemControl final : public Peripheral {
public:
    SystemControl(Nvic& nvic, std::function<void()> request_reset);

    [[nodiscard]] std::uint32_t vector_table() const { return registers_[kVtor]; }
    /// True if CPACR gives code full access to coprocessors 10 and 11.
    [[nodiscard]] bool float_is_on() const { return field(registers_[kCpacr], 20, 4) == 0xFU; }
    [[nodiscard]] bool stack_aligned() const { return is_set(registers_[kCcr], 9); }
    [[nodiscard]] bool traps_unaligned() const { return is_set(registers_[kCcr], 3); }
    [[nodiscard]] bool traps_division() const { return is_set(registers_[kCcr], 4); }

    [[nodiscard]] bool sleeps_on_exit() const { return is_set(registers_[kScr], 1); }
    [[nodiscard]] bool sleeps_deeply() const { return is_set(registers_[kScr], 2); }
    [[nodiscard]] bool pending_is_event() const { return is_set(registers_[kScr], 4); }

    // FPCCR and FPCAR: stack address of the interrupted program's floating-point registers while their save is pending.
    [[nodiscard]] bool saves_float() const { return is_set(registers_[kFpccr], 31); }
    [[nodiscard]] bool saves_lazily() const { return is_set(registers_[kFpccr], 30); }
    [[nodiscard]] bool lazy_save_waits() const { return is_set(registers_[kFpccr], 0); }
    [[nodiscard]] std::uint32_t lazy_save_address() const { return registers_[kFpcar]; }
    void wait_for_lazy_save(std::uint32_t address);
    void end_lazy_save() { registers_.at(kFpccr) &= ~1U; }
    [[nodiscard]] std::uint32_t default_fpscr() const { return registers_[kFpdscr]; }

    [[nodiscard]] const Mpu& mpu() const { return mpu_; }

    // Bits of CFSR.
    static constexpr std::uint32_t kForbiddenFetch = 1U << 0U;            // IACCVIOL
    static constexpr std::uint32_t kForbiddenData = 1U << 1U | 1U << 7U;  // DACCVIOL, MMARVALID
    static constexpr std::uint32_t kForbiddenStacking = 1U << 4U;         // MSTKERR
    static constexpr std::uint32_t kFetchError = 1U << 8U;                // IBUSERR
    static constexpr std::uint32_t kDataBusError = 1U << 9U | 1U << 15U;  // PRECISERR, BFARVALID
    static constexpr std::uint32_t kStackingError = 1U << 12U;            // STKERR
    static constexpr std::uint32_t kUndefined = 1U << 16U;                // UNDEFINSTR
    /// Notes a fault. `address`: for MMFAR or BFAR, if it becomes valid. Returns its exception, HardFault if SHCSR does not
    /// enable the fault's own.
    int note_fault(std::uint32_t bits, std::uint32_t address);
    void escalate_fault();

    std::uint32_t read(std::uint32_t offset) override;
    void write(std::uint32_t offset, std::uint32_t value) override;
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override;
    [[nodiscard]] std::span<const Register> registers() const override { return registers_.list(); }
    void reset() override;

    /// Number of the running exception, for ICSR.
    void set_running(int exception) { running_ = exception; }

private:
    static constexpr std::uint32_t kVtor = 0x08;
    static constexpr std::uint32_t kScr = 0x10;
    static constexpr std::uint32_t kCcr = 0x14;
    static constexpr std::uint32_t kCpacr = 0x88;
    static constexpr std::uint32_t kFpccr = 0x234;
    static constexpr std::uint32_t kFpcar = 0x238;
    static constexpr std::uint32_t kFpdscr = 0x23C;

    [[nodiscard]] std::uint32_t interrupt_state() const;
    void control_interrupts(std::uint32_t value);

    Nvic& nvic_;
    std::function<void()> request_reset_;
    RegisterFile registers_;
    Mpu mpu_;
    int running_ = 0;
};

/// 0xE000E010: down-counter of processor cycles, or of every eighth.
class SysTick final : public RegisterPeripheral {
public:
    /// `ticks_per_cycle`: at the present core clock.
    SysTick(Events& events, Nvic& nvic, std::function<Ticks()> ticks_per_cycle);

    [[nodiscard]] std::uint32_t count() const;
    /// Continues at `count` at the present frequency.
    void count_from(std::uint32_t count);

    std::uint32_t read(std::uint32_t offset) override;
    void reset() override;

private:
    static constexpr std::uint32_t kControl = 0x0;
    static constexpr std::uint32_t kLoad = 0x4;
    static constexpr std::uint32_t kValue = 0x8;
    void apply(std::uint32_t offset, std::uint32_t value) override;
    void wrap();
    void start();
    [[nodiscard]] Ticks ticks_per_count() const { return ticks_per_cycle_() * (is_divided() ? 8 : 1); }
    [[nodiscard]] bool is_divided() const { return !is_set(registers_[kControl], 2); }

    Events& events_;
    Nvic& nvic_;
    std::function<Ticks()> ticks_per_cycle_;
    Event wrap_;
    bool counted_ = false;
};

/// 0xE0001000: CTRL and CYCCNT of the DWT. SystemControl has DEMCR.
class CycleCounter final : public RegisterPeripheral {
public:
    explicit CycleCounter(const std::uint64_t& cycles)
        : RegisterPeripheral({{kControl, 0x40000000, "CTRL", kAllBits}, {kCount, 0, "CYCCNT", kAllBits}}), cycles_(cycles) {}
    std::uint32_t read(std::uint32_t offset) override;

private:
    static constexpr std::uint32_t kControl = 0x0;
    static constexpr std::uint32_t kCount = 0x4;
    void apply(std::uint32_t offset, std::uint32_t value) override;

    const std::uint64_t& cycles_;
    std::uint64_t zero_ = 0;
};

/// 0xE0000000: instrumentation trace (ITM). Nothing reads the trace, so its ports are always ready.
class TraceMacrocell final : public Peripheral {
public:
    std::uint32_t read(std::uint32_t offset) override { return offset < kPortBytes ? 1 : words_[offset / 4]; }
    void write(std::uint32_t offset, std::uint32_t value) override { words_.at(offset / 4) = value; }
    void write_narrow(std::uint32_t, std::uint32_t, unsigned) override {}
    void reset() override { words_ = {}; }

private:
    static constexpr std::uint32_t kPortBytes = 0x80;
    std::array<std::uint32_t, 0x400> words_{};
};

}  // namespace tricoil::virtual_board

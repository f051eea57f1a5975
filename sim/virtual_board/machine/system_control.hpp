// Registers of the processor's private bus: system control block, SysTick, floating-point context, cycle counter.
#pragma once

#include <functional>

#include "sim/virtual_board/machine/mpu.hpp"
#include "sim/virtual_board/machine/nvic.hpp"

namespace tricoil::virtual_board {

/// System control block and floating-point context registers, 0xE000ED00-0xE000EFFF (ARMv7-M B3.2).
class SystemControl final : public Peripheral {
public:
    SystemControl(Nvic& nvic, std::function<void()> request_reset) : nvic_(nvic), request_reset_(std::move(request_reset)) {}

    [[nodiscard]] std::uint32_t vector_table() const { return vtor_; }
    /// True if CPACR gives code full access to coprocessors 10 and 11.
    [[nodiscard]] bool float_is_on() const { return (cpacr_ >> 20U & 0xFU) == 0xFU; }
    [[nodiscard]] bool stack_aligned() const { return (ccr_ & 1U << 9U) != 0; }

    [[nodiscard]] bool sleeps_on_exit() const { return (scr_ & 2U) != 0; }
    [[nodiscard]] bool sleeps_deeply() const { return (scr_ & 4U) != 0; }
    [[nodiscard]] bool pending_is_event() const { return (scr_ & 0x10U) != 0; }

    // FPCCR and FPCAR: stack address of the interrupted program's floating-point registers while their save is pending.
    [[nodiscard]] bool saves_float() const { return (fpccr_ & 1U << 31U) != 0; }
    [[nodiscard]] bool saves_lazily() const { return (fpccr_ & 1U << 30U) != 0; }
    [[nodiscard]] bool lazy_save_waits() const { return (fpccr_ & 1U) != 0; }
    [[nodiscard]] std::uint32_t lazy_save_address() const { return fpcar_; }
    void wait_for_lazy_save(std::uint32_t address);
    void end_lazy_save() { fpccr_ &= ~1U; }
    [[nodiscard]] std::uint32_t default_fpscr() const { return fpdscr_; }

    [[nodiscard]] const Mpu& mpu() const { return mpu_; }

    // Bits of CFSR.
    static constexpr std::uint32_t kForbiddenFetch = 1U << 0U;            // IACCVIOL
    static constexpr std::uint32_t kForbiddenData = 1U << 1U | 1U << 7U;  // DACCVIOL, MMARVALID
    static constexpr std::uint32_t kForbiddenStacking = 1U << 4U;         // MSTKERR
    static constexpr std::uint32_t kFetchError = 1U << 8U;                // IBUSERR
    static constexpr std::uint32_t kDataBusError = 1U << 9U | 1U << 15U;  // PRECISERR, BFARVALID
    static constexpr std::uint32_t kStackingError = 1U << 12U;            // STKERR
    static constexpr std::uint32_t kUndefined = 1U << 16U;                // UNDEFINSTR
    /// Notes a fault that is escalated to HardFault. `address`: for MMFAR or BFAR, if it becomes valid.
    void note_fault(std::uint32_t bits, std::uint32_t address);

    std::uint32_t read(std::uint32_t offset) override;
    void write(std::uint32_t offset, std::uint32_t value) override;
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override;
    [[nodiscard]] std::span<const Register> registers() const override;
    void reset() override;

    /// Number of the running exception, for ICSR.
    void set_running(int exception) { running_ = exception; }

private:
    [[nodiscard]] std::uint32_t interrupt_state() const;
    void control_interrupts(std::uint32_t value);

    Nvic& nvic_;
    std::function<void()> request_reset_;
    std::uint32_t vtor_ = 0;
    std::uint32_t scr_ = 0;
    std::uint32_t ccr_ = 0;
    std::uint32_t shcsr_ = 0;
    std::uint32_t cfsr_ = 0;
    std::uint32_t hfsr_ = 0;
    std::uint32_t mmfar_ = 0;
    std::uint32_t bfar_ = 0;
    Mpu mpu_;
    std::uint32_t cpacr_ = 0;
    std::uint32_t fpccr_ = 0;
    std::uint32_t fpcar_ = 0;
    std::uint32_t fpdscr_ = 0;
    int running_ = 0;
};

/// 0xE000E010: down-counter of processor cycles, or of every eighth.
class SysTick final : public Peripheral {
public:
    /// `ticks_per_cycle`: at the present core clock.
    SysTick(Events& events, Nvic& nvic, std::function<Ticks()> ticks_per_cycle);

    [[nodiscard]] std::uint32_t count() const;
    /// Continues at `count` at the present frequency.
    void count_from(std::uint32_t count);

    std::uint32_t read(std::uint32_t offset) override;
    void write(std::uint32_t offset, std::uint32_t value) override;
    [[nodiscard]] std::span<const Register> registers() const override;
    void reset() override;

private:
    void wrap();
    void start();
    [[nodiscard]] Ticks ticks_per_count() const { return ticks_per_cycle_() * (is_divided() ? 8 : 1); }
    [[nodiscard]] bool is_divided() const { return (control_ & 4U) == 0; }

    Events& events_;
    Nvic& nvic_;
    std::function<Ticks()> ticks_per_cycle_;
    Event wrap_;
    std::uint32_t control_ = 0;
    std::uint32_t load_ = 0;
    bool counted_ = false;
};

/// 0xE0001000: CTRL and CYCCNT of the DWT. SystemControl has DEMCR.
class CycleCounter final : public Peripheral {
public:
    explicit CycleCounter(const std::uint64_t& cycles) : cycles_(cycles) {}
    std::uint32_t read(std::uint32_t offset) override;
    void write(std::uint32_t offset, std::uint32_t value) override;
    [[nodiscard]] std::span<const Register> registers() const override;
    void reset() override { control_ = 0; }

private:
    const std::uint64_t& cycles_;
    std::uint32_t control_ = 0;
    std::uint64_t zero_ = 0;
    std::uint32_t stopped_at_ = 0;
};

}  // namespace tricoil::virtual_board

// Reset reason, fault flags and restart of the processor.
#pragma once

#include "drivers/stm32g4/registers/cortex.hpp"
#include "drivers/stm32g4/registers/rcc.hpp"
#include "hal/system_control.hpp"

namespace tricoil::stm32g4 {

/// Words in RAM that the start-up code does not clear; they carry information across a reset. After power-on their content is
/// undefined, so only the exact values of the constants are valid.
struct BootRecord {
    static constexpr std::uint32_t kEnterLoader = 0x10ADE2B0;
    static constexpr std::uint32_t kFreshStart = 0xF2E5'4A27;  // set before a reset whose only purpose is a clean start
    static constexpr std::uint32_t kFaulted = 0xFA017ED5;
    static constexpr std::uint32_t kAssertionFailed = 0xA55E'27ED;

    std::uint32_t request;  // kEnterLoader or kFreshStart; any other value: none
    std::uint32_t ending;   // kFaulted: a fault, described by the words below; kAssertionFailed: described by pc
    std::uint32_t exception;
    std::uint32_t pc;  // of the faulty instruction, or of the instruction after the call of assertion_failed()
    std::uint32_t lr;
    std::uint32_t cfsr;  // ARMv7-M B3.2.15
};

class Processor final : public hal::SystemControl {
public:
    struct Hooks {
        bool (*stack_was_full)();
        void (*sleep)();           // until any interrupt
        void (*wait_for_reset)();  // does not return on a processor
    };

    Processor(RccRegisters& rcc, ScbRegisters& scb, BootRecord& record, const Hooks& hooks)
        : rcc_(rcc), scb_(scb), record_(record), hooks_(hooks) {}

    /// Call once: reads and clears the reset flags and the `ending` of the last run.
    void begin();

    /// Sets a fault until the next reset. May be called in any context.
    void report(hal::SystemFault fault);

private:
    [[nodiscard]] hal::ResetReason do_reset_reason() const override { return reason_; }
    [[nodiscard]] hal::SystemFaults do_faults() const override;
    void do_idle() override { hooks_.sleep(); }
    void do_restart() override;
    void do_restart_into_loader() override;

    RccRegisters& rcc_;
    ScbRegisters& scb_;
    BootRecord& record_;
    Hooks hooks_;
    hal::ResetReason reason_ = hal::ResetReason::power_on;
    hal::SystemFaults faults_;
};

}  // namespace tricoil::stm32g4

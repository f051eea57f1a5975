// Why the processor began, how it is, and how it begins again.
#pragma once

#include "drivers/stm32g4/registers/cortex.hpp"
#include "drivers/stm32g4/registers/rcc.hpp"
#include "hal/system_control.hpp"

namespace tricoil::stm32g4 {

/// Words in RAM that no start-up code clears: what one run leaves to the next. After power-on they hold anything: only the exact
/// words count.
struct BootRecord {
    static constexpr std::uint32_t kEnterLoader = 0x10ADE2B0;
    static constexpr std::uint32_t kFreshStart = 0xF2E5'4A27;  // set before a reset that only takes away what was left behind
    static constexpr std::uint32_t kFaulted = 0xFA017ED5;

    std::uint32_t request;  // one of these, or nothing
    std::uint32_t ending;   // kFaulted: a fault, of which
    std::uint32_t exception;
    std::uint32_t pc;
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

    /// Once: takes what the last run left, so that the next one does not find it again.
    void begin();

    /// Stays until the next reset. Any context.
    void report(hal::SystemTrouble trouble);

private:
    [[nodiscard]] hal::ResetReason do_reset_reason() const override { return reason_; }
    [[nodiscard]] hal::SystemTroubles do_troubles() const override;
    void do_idle() override { hooks_.sleep(); }
    void do_restart() override;
    void do_restart_into_loader() override;

    RccRegisters& rcc_;
    ScbRegisters& scb_;
    BootRecord& record_;
    Hooks hooks_;
    hal::ResetReason reason_ = hal::ResetReason::power_on;
    hal::SystemTroubles troubles_;
};

}  // namespace tricoil::stm32g4

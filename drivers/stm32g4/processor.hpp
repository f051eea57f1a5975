// Reset reason, program errors, fault flags and restart of the processor.
#pragma once

#include "drivers/stm32g4/boot_record.hpp"
#include "drivers/stm32g4/registers/cortex.hpp"
#include "drivers/stm32g4/registers/rcc.hpp"
#include "hal/system_control.hpp"

namespace tricoil::stm32g4 {

class Processor final : public hal::SystemControl {
public:
    struct Hooks {
        bool (*stack_was_full)();
        void (*sleep)();           // until any interrupt
        void (*wait_for_reset)();  // does not return on a processor
    };

    Processor(RccRegisters& rcc, ScbRegisters& scb, BootRecord& record, const Hooks& hooks)
        : rcc_(rcc), scb_(scb), record_(record), hooks_(hooks) {}

    /// Call once: reads and clears the reset flags, and reads the error of the last run.
    void begin();

    /// A damaged image is a fault: the coils stay off.
    void report_image(bool is_sound, std::uint32_t crc);

    void report_settings(std::uint32_t options);

    /// Resets; `request`: of BootRecord, or 0. Does not return on a processor.
    void restart(std::uint32_t request);

    using hal::SystemControl::report;
    /// Sets a fault until the next reset. May be called in any context.
    void report(hal::SystemFault fault);

private:
    [[nodiscard]] hal::ResetReason do_reset_reason() const override { return reason_; }
    [[nodiscard]] hal::SystemFaults do_faults() const override;
    [[nodiscard]] const hal::SystemReport& do_report() const override { return report_; }
    void do_idle() override { hooks_.sleep(); }
    void do_restart_into_loader() override { restart(BootRecord::kEnterLoader); }

    RccRegisters& rcc_;
    ScbRegisters& scb_;
    BootRecord& record_;
    Hooks hooks_;
    hal::ResetReason reason_ = hal::ResetReason::power_on;
    hal::SystemFaults faults_;
    hal::SystemReport report_;
};

}  // namespace tricoil::stm32g4

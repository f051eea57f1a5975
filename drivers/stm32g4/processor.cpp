#include "drivers/stm32g4/processor.hpp"

#include "drivers/stm32g4/option_bytes.hpp"

namespace tricoil::stm32g4 {
namespace {

/// Every reset also sets the flag of the reset pin, so that flag is not checked: without another reason the reset is external.
hal::ResetReason reason_of(std::uint32_t flags, bool faulted) {
    if (faulted) {
        return hal::ResetReason::fault;
    }
    if ((flags & (rcc::CSR_IWDGRSTF | rcc::CSR_WWDGRSTF)) != 0) {
        return hal::ResetReason::watchdog;
    }
    if ((flags & rcc::CSR_SFTRSTF) != 0) {
        return hal::ResetReason::software;
    }
    return (flags & rcc::CSR_BORRSTF) != 0 ? hal::ResetReason::power_on : hal::ResetReason::external;
}

hal::CrashRecord crash_of(const BootRecord& record) {
    static_assert(static_cast<std::uint32_t>(hal::CrashRecord::Kind::fault) == BootRecord::kFaulted);
    static_assert(static_cast<std::uint32_t>(hal::CrashRecord::Kind::assertion) == BootRecord::kAssertionFailed);
    static_assert(static_cast<std::uint32_t>(hal::CrashRecord::Kind::watchdog) == BootRecord::kHung);
    static_assert(static_cast<std::uint32_t>(hal::CrashRecord::Kind::stack) == BootRecord::kStackOverflow);
    return {static_cast<hal::CrashRecord::Kind>(record.ending),
            static_cast<std::uint16_t>(record.count),
            static_cast<std::uint16_t>(record.exception),
            record.pc,
            record.lr,
            record.cfsr,
            record.address};
}

}  // namespace

void Processor::begin() {
    const std::uint32_t flags = rcc_.CSR;
    rcc_.CSR = flags | rcc::CSR_RMVF;
    if ((flags & rcc::CSR_BORRSTF) != 0 || !record_.is_valid()) {  // the content of RAM is undefined after power-on
        record_.forget();
    }
    const bool has_crashed = record_.take_last_run_failed();
    reason_ = reason_of(flags, has_crashed);
    if (reason_ == hal::ResetReason::watchdog) {
        record_.note({.ending = BootRecord::kHung});
        (void)record_.take_last_run_failed();
    }
    report_.crash = crash_of(record_);
}

void Processor::report_image(bool is_sound, std::uint32_t crc) {
    report_.image = is_sound ? hal::ImageState::sound : hal::ImageState::damaged;
    report_.image_crc = crc;
    faults_.set_if(!is_sound, hal::SystemFault::memory);
}

void Processor::report_settings(std::uint32_t options) {
    report_.has_settings = true;
    report_.settings = options;
    report_.setting_faults = setting_faults(options);
}

void Processor::report(hal::SystemFault trouble) { faults_.set(trouble); }

hal::SystemFaults Processor::do_faults() const {
    hal::SystemFaults faults = faults_;
    faults.set_if(hooks_.stack_was_full(), hal::SystemFault::stack);
    return faults;
}

void Processor::restart(std::uint32_t request) {
    record_.request = request;
    scb_.AIRCR = scb::AIRCR_reset;
    hooks_.wait_for_reset();
}

}  // namespace tricoil::stm32g4

#include "drivers/stm32g4/processor.hpp"

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

}  // namespace

void Processor::begin() {
    const std::uint32_t flags = rcc_.CSR;
    // The content of RAM is undefined after power-on.
    const bool ended_itself = record_.ending == BootRecord::kFaulted || record_.ending == BootRecord::kAssertionFailed;
    const bool faulted = ended_itself && (flags & rcc::CSR_BORRSTF) == 0;
    reason_ = reason_of(flags, faulted);
    record_.ending = 0;
    rcc_.CSR = flags | rcc::CSR_RMVF;
}

void Processor::report(hal::SystemFault trouble) { faults_.set(trouble); }

hal::SystemFaults Processor::do_faults() const {
    hal::SystemFaults faults = faults_;
    faults.set_if(hooks_.stack_was_full(), hal::SystemFault::stack);
    return faults;
}

void Processor::do_restart() {
    scb_.AIRCR = scb::AIRCR_reset;
    hooks_.wait_for_reset();
}

void Processor::do_restart_into_loader() {
    record_.request = BootRecord::kEnterLoader;
    do_restart();
}

}  // namespace tricoil::stm32g4

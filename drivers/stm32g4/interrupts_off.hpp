// Critical section: disables interrupts for a few instructions.
#pragma once

#include <cstdint>

namespace tricoil::stm32g4 {

/// Interrupts are disabled while the object lives; objects may be nested. No effect on a host, where tests call handlers
/// directly.
class InterruptsOff {
public:
#ifdef __arm__
    InterruptsOff() { asm volatile("mrs %0, primask\n cpsid i" : "=r"(before_)::"memory"); }
    ~InterruptsOff() { asm volatile("msr primask, %0" ::"r"(before_) : "memory"); }
#else
    InterruptsOff() {}   // NOLINT(modernize-use-equals-default): a defaulted pair would make every guard an unused variable
    ~InterruptsOff() {}  // NOLINT(modernize-use-equals-default)
#endif
    InterruptsOff(const InterruptsOff&) = delete;
    InterruptsOff& operator=(const InterruptsOff&) = delete;

private:
#ifdef __arm__
    std::uint32_t before_;
#endif
};

}  // namespace tricoil::stm32g4

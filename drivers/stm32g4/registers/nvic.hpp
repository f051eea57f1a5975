// Nested vectored interrupt controller of the Cortex-M4 (ARMv7-M Architecture Reference Manual, B3.4).
#pragma once

#include <cstddef>
#include <cstdint>

namespace tricoil::stm32g4 {

struct NvicRegisters {
    volatile std::uint32_t ISER[8];  // set-enable
    std::uint32_t reserved_0[56];
    volatile std::uint32_t ISPR[8];  // set-pending
    std::uint32_t reserved_1[120];
    volatile std::uint8_t IPR[240];  // priority, the upper four bits
};
static_assert(offsetof(NvicRegisters, ISPR) == 0x100);
static_assert(offsetof(NvicRegisters, IPR) == 0x300);

constexpr std::uintptr_t kNvicBase = 0xE000E100;

}  // namespace tricoil::stm32g4

// Power control (RM0440, chapter PWR).
#pragma once

#include <cstddef>
#include <cstdint>

namespace tricoil::stm32g4 {

struct PwrRegisters {
    volatile std::uint32_t CR1;
    volatile std::uint32_t CR2;
    volatile std::uint32_t CR3;
    std::uint32_t reserved_0[2];
    volatile std::uint32_t SR2;
    std::uint32_t reserved_1[26];
    volatile std::uint32_t CR5;
};
static_assert(offsetof(PwrRegisters, SR2) == 0x14);
static_assert(offsetof(PwrRegisters, CR5) == 0x80);

constexpr std::uintptr_t kPwrBase = 0x4000'7000;

namespace pwr {
constexpr std::uint32_t CR3_UCPD1_DBDIS = 1U << 14U;  // disables the dead-battery pull-downs (USB-C) on PB4 and PB6
constexpr std::uint32_t SR2_VOSF = 1U << 10U;         // the regulator output is still changing
constexpr std::uint32_t CR5_R1MODE = 1U << 8U;        // cleared: boost mode, for more than 150 MHz
}  // namespace pwr

}  // namespace tricoil::stm32g4

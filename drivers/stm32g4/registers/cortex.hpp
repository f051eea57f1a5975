// Registers of the Cortex-M4 (ARMv7-M Architecture Reference Manual, B3): interrupt controller, system control block, SysTick,
// cycle counter.
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

struct ScbRegisters {
    std::uint32_t reserved_0[2];
    volatile std::uint32_t VTOR;
    volatile std::uint32_t AIRCR;
    std::uint32_t reserved_1[2];
    volatile std::uint8_t SHPR[12];  // priorities of exceptions 4-15
    std::uint32_t reserved_2;
    volatile std::uint32_t CFSR;
    std::uint32_t reserved_3[2];
    volatile std::uint32_t MMFAR;
    volatile std::uint32_t BFAR;
};
static_assert(offsetof(ScbRegisters, SHPR) == 0x18);
static_assert(offsetof(ScbRegisters, CFSR) == 0x28);

struct SysTickRegisters {
    volatile std::uint32_t CSR;
    volatile std::uint32_t RVR;
    volatile std::uint32_t CVR;
};

struct MpuRegisters {
    std::uint32_t reserved_0;
    volatile std::uint32_t CTRL;
    std::uint32_t reserved_1;
    volatile std::uint32_t RBAR;
    volatile std::uint32_t RASR;
};
static_assert(offsetof(MpuRegisters, RASR) == 0x10);

constexpr std::uintptr_t kMpuBase = 0xE000'ED90;
constexpr std::uintptr_t kScbBase = 0xE000'ED00;
constexpr std::uintptr_t kSysTickBase = 0xE000'E010;
constexpr std::uintptr_t kDemcr = 0xE000'EDFC;  // bit 24 enables the cycle counter's unit

namespace scb {
constexpr std::uint32_t AIRCR_reset = 0x05FA'0004;  // key, SYSRESETREQ
constexpr std::uint32_t CFSR_MSTKERR = 1U << 4U;    // the exception could not push its registers: memory protection
constexpr std::uint32_t CFSR_MMARVALID = 1U << 7U;  // MMFAR holds the address of the access
constexpr std::uint32_t CFSR_STKERR = 1U << 12U;    // the exception could not push its registers: bus error
constexpr std::uint32_t CFSR_BFARVALID = 1U << 15U;
constexpr std::size_t SHPR_SysTick = 15 - 4;
}  // namespace scb

namespace mpu {
constexpr std::uint32_t CTRL_ENABLE = 1U << 0U;
constexpr std::uint32_t CTRL_PRIVDEFENA = 1U << 2U;  // outside the regions the default map applies
constexpr std::uint32_t RBAR_VALID = 1U << 4U;       // bits 0-3 are the number of the region
constexpr std::uint32_t RASR_ENABLE = 1U << 0U;
constexpr unsigned RASR_SIZE_Pos = 1;  // the size is 2^(n + 1) bytes
constexpr std::uint32_t RASR_C = 1U << 17U;
constexpr std::uint32_t RASR_S = 1U << 18U;
constexpr std::uint32_t RASR_AP_none = 0U << 24U;
constexpr std::uint32_t RASR_AP_full = 3U << 24U;
constexpr std::uint32_t RASR_XN = 1U << 28U;
}  // namespace mpu

namespace systick {
constexpr std::uint32_t CSR_ENABLE = 1U << 0U;
constexpr std::uint32_t CSR_TICKINT = 1U << 1U;
constexpr std::uint32_t CSR_CLKSOURCE = 1U << 2U;
}  // namespace systick

}  // namespace tricoil::stm32g4

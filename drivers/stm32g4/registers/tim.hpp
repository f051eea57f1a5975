// Timers (RM0440, chapters TIM2/3/4/5 and TIM6/TIM7): registers of a time base.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tricoil::stm32g4 {

struct TimRegisters {
    volatile std::uint32_t CR1;
    volatile std::uint32_t CR2;
    std::uint32_t reserved_0[2];
    volatile std::uint32_t SR;
    volatile std::uint32_t EGR;
    std::uint32_t reserved_1[3];
    volatile std::uint32_t CNT;
    volatile std::uint32_t PSC;
    volatile std::uint32_t ARR;
};
static_assert(offsetof(TimRegisters, EGR) == 0x14);
static_assert(offsetof(TimRegisters, CNT) == 0x24);
static_assert(offsetof(TimRegisters, ARR) == 0x2C);

constexpr std::uintptr_t kTim2Base = 0x4000'0000;  // 32 bits
constexpr std::uintptr_t kTim6Base = 0x4000'1000;  // 16 bits; triggers converters

namespace tim {
constexpr std::uint32_t CR1_CEN = 1U << 0U;
constexpr std::uint32_t CR1_URS = 1U << 2U;         // only an overflow causes an update interrupt or DMA request
constexpr std::uint32_t CR2_MMS_update = 2U << 4U;  // TRGO on each update
constexpr std::uint32_t EGR_UG = 1U << 0U;
}  // namespace tim

}  // namespace tricoil::stm32g4

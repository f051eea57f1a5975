// Digital-to-analog converters (RM0440, chapter DAC).
#pragma once

#include <cstddef>
#include <cstdint>

namespace tricoil::stm32g4 {

struct DacRegisters {
    volatile std::uint32_t CR;
    volatile std::uint32_t SWTRIGR;
    volatile std::uint32_t DHR12R1;
    std::uint32_t reserved_0[2];
    volatile std::uint32_t DHR12R2;
    std::uint32_t reserved_1[7];
    volatile std::uint32_t SR;
    volatile std::uint32_t CCR;
    volatile std::uint32_t MCR;
};
static_assert(offsetof(DacRegisters, DHR12R2) == 0x14);
static_assert(offsetof(DacRegisters, SR) == 0x34);
static_assert(offsetof(DacRegisters, MCR) == 0x3C);

constexpr std::uintptr_t kDac1Base = 0x5000'0800;
constexpr std::uintptr_t kDac2Base = 0x5000'0C00;
constexpr std::uintptr_t kDac3Base = 0x5000'1000;
constexpr std::uintptr_t kDac4Base = 0x5000'1400;

namespace dac {
// Bits of channel 1; the bits of channel 2 are 16 positions higher.
constexpr unsigned kChannel2Shift = 16;
constexpr std::uint32_t CR_EN1 = 1U << 0U;
constexpr std::uint32_t CR_TEN1 = 1U << 1U;
constexpr std::uint32_t CR_TSEL1_TIM6 = 7U << 2U;
constexpr std::uint32_t CR_DMAEN1 = 1U << 12U;
constexpr std::uint32_t SR_DAC1RDY = 1U << 11U;
constexpr std::uint32_t SR_DMAUDR1 = 1U << 13U;       // DMA underrun; write 1 to clear
constexpr std::uint32_t MCR_MODE1_pin = 0;            // buffered
constexpr std::uint32_t MCR_MODE1_inside = 3U << 0U;  // to on-chip peripherals, unbuffered
constexpr std::uint32_t MCR_HFSEL_above_160MHz = 2U << 14U;
}  // namespace dac

}  // namespace tricoil::stm32g4

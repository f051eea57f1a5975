// DMA controller and request multiplexer (RM0440, chapters DMA and DMAMUX).
#pragma once

#include <cstddef>
#include <cstdint>

namespace tricoil::stm32g4 {

struct DmaChannelRegisters {
    volatile std::uint32_t CCR;
    volatile std::uint32_t CNDTR;
    volatile std::uint32_t CPAR;
    volatile std::uint32_t CMAR;
    std::uint32_t reserved;
};

struct DmaRegisters {
    volatile std::uint32_t ISR;
    volatile std::uint32_t IFCR;
    DmaChannelRegisters channel[8];  // channel[0] is channel 1
};
static_assert(offsetof(DmaRegisters, channel) == 0x08);
static_assert(sizeof(DmaChannelRegisters) == 0x14);

struct DmamuxRegisters {
    volatile std::uint32_t CCR[16];  // of DMA1's channels 1-8, then DMA2's
};

constexpr std::uintptr_t kDma1Base = 0x4002'0000;
constexpr std::uintptr_t kDmamux1Base = 0x4002'0800;

namespace dma {
// ISR and IFCR have four flags per channel: any, complete, half, error.
constexpr unsigned kFlagsPerChannel = 4;
constexpr std::uint32_t ISR_GIF = 1U << 0U;
constexpr std::uint32_t ISR_TCIF = 1U << 1U;
constexpr std::uint32_t ISR_HTIF = 1U << 2U;
constexpr std::uint32_t ISR_TEIF = 1U << 3U;

constexpr std::uint32_t CCR_EN = 1U << 0U;
constexpr std::uint32_t CCR_TCIE = 1U << 1U;
constexpr std::uint32_t CCR_HTIE = 1U << 2U;
constexpr std::uint32_t CCR_TEIE = 1U << 3U;
constexpr std::uint32_t CCR_DIR_from_memory = 1U << 4U;
constexpr std::uint32_t CCR_CIRC = 1U << 5U;
constexpr std::uint32_t CCR_MINC = 1U << 7U;
constexpr std::uint32_t CCR_PSIZE_16 = 1U << 8U;
constexpr std::uint32_t CCR_PSIZE_32 = 2U << 8U;
constexpr std::uint32_t CCR_MSIZE_16 = 1U << 10U;
constexpr std::uint32_t CCR_PL_very_high = 3U << 12U;
}  // namespace dma

}  // namespace tricoil::stm32g4

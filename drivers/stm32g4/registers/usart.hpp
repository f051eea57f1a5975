// Universal synchronous/asynchronous receiver/transmitter (RM0440, chapter USART).
#pragma once

#include <cstddef>
#include <cstdint>

namespace tricoil::stm32g4 {

struct UsartRegisters {
    volatile std::uint32_t CR1;
    volatile std::uint32_t CR2;
    volatile std::uint32_t CR3;
    volatile std::uint32_t BRR;
    std::uint32_t reserved[3];
    volatile std::uint32_t ISR;
    volatile std::uint32_t ICR;
    volatile std::uint32_t RDR;
    volatile std::uint32_t TDR;
    volatile std::uint32_t PRESC;
};
static_assert(offsetof(UsartRegisters, ISR) == 0x1C);
static_assert(offsetof(UsartRegisters, TDR) == 0x28);
static_assert(sizeof(UsartRegisters) == 0x30);

constexpr std::uintptr_t kUsart2Base = 0x4000'4400;
constexpr std::uint8_t kUsart2Interrupt = 38;

namespace usart {
// CR1; bits with two names are listed under the name for FIFO mode.
constexpr std::uint32_t CR1_UE = 1U << 0U;
constexpr std::uint32_t CR1_RE = 1U << 2U;
constexpr std::uint32_t CR1_TE = 1U << 3U;
constexpr std::uint32_t CR1_RXFNEIE = 1U << 5U;
constexpr std::uint32_t CR1_TXFNFIE = 1U << 7U;
constexpr std::uint32_t CR1_FIFOEN = 1U << 29U;
// CR3
constexpr std::uint32_t CR3_EIE = 1U << 0U;
// ISR
constexpr std::uint32_t ISR_FE = 1U << 1U;
constexpr std::uint32_t ISR_NE = 1U << 2U;
constexpr std::uint32_t ISR_ORE = 1U << 3U;
constexpr std::uint32_t ISR_RXFNE = 1U << 5U;
constexpr std::uint32_t ISR_TXFNF = 1U << 7U;
constexpr std::uint32_t ISR_TEACK = 1U << 21U;
constexpr std::uint32_t ISR_REACK = 1U << 22U;
// ICR: same positions as the flags in ISR
constexpr std::uint32_t ICR_FECF = 1U << 1U;
constexpr std::uint32_t ICR_NECF = 1U << 2U;
constexpr std::uint32_t ICR_ORECF = 1U << 3U;
}  // namespace usart

}  // namespace tricoil::stm32g4

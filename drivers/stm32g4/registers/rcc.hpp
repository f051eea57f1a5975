// Reset and clock control (RM0440, chapter RCC).
#pragma once

#include <cstddef>
#include <cstdint>

namespace tricoil::stm32g4 {

struct RccRegisters {
    volatile std::uint32_t CR;
    volatile std::uint32_t ICSCR;
    volatile std::uint32_t CFGR;
    volatile std::uint32_t PLLCFGR;
    std::uint32_t reserved_0[3];
    volatile std::uint32_t CIFR;
    volatile std::uint32_t CICR;
    std::uint32_t reserved_1[9];
    volatile std::uint32_t AHB1ENR;
    volatile std::uint32_t AHB2ENR;
    std::uint32_t reserved_2[2];
    volatile std::uint32_t APB1ENR1;
    volatile std::uint32_t APB1ENR2;
    volatile std::uint32_t APB2ENR;
    std::uint32_t reserved_3[9];
    volatile std::uint32_t CCIPR;
    std::uint32_t reserved_4[2];
    volatile std::uint32_t CSR;
    volatile std::uint32_t CRRCR;
};
static_assert(offsetof(RccRegisters, CIFR) == 0x1C);
static_assert(offsetof(RccRegisters, AHB1ENR) == 0x48);
static_assert(offsetof(RccRegisters, APB1ENR1) == 0x58);
static_assert(offsetof(RccRegisters, CCIPR) == 0x88);
static_assert(offsetof(RccRegisters, CRRCR) == 0x98);

constexpr std::uintptr_t kRccBase = 0x4002'1000;

namespace rcc {
constexpr std::uint32_t CR_HSEON = 1U << 16U;
constexpr std::uint32_t CR_HSERDY = 1U << 17U;
constexpr std::uint32_t CR_CSSON = 1U << 19U;
constexpr std::uint32_t CR_PLLON = 1U << 24U;
constexpr std::uint32_t CR_PLLRDY = 1U << 25U;

constexpr std::uint32_t CFGR_SW = 3U;  // requested source; SWS, two bits higher, is the active source
constexpr std::uint32_t CFGR_SW_PLL = 3U;
constexpr std::uint32_t CFGR_SWS = 3U << 2U;
constexpr std::uint32_t CFGR_SWS_HSI = 1U << 2U;
constexpr std::uint32_t CFGR_SWS_PLL = 3U << 2U;
constexpr std::uint32_t CFGR_HPRE = 15U << 4U;
constexpr std::uint32_t CFGR_HPRE_DIV2 = 8U << 4U;

constexpr std::uint32_t PLLCFGR_PLLSRC_HSI = 2U;
constexpr std::uint32_t PLLCFGR_PLLSRC_HSE = 3U;
constexpr unsigned PLLCFGR_PLLM_Pos = 4;  // value M - 1
constexpr unsigned PLLCFGR_PLLN_Pos = 8;
constexpr std::uint32_t PLLCFGR_PLLREN = 1U << 24U;  // PLLR = 0 divides by 2

constexpr std::uint32_t CIFR_CSSF = 1U << 8U;
constexpr std::uint32_t CICR_CSSC = 1U << 8U;

constexpr std::uint32_t AHB1ENR_DMA1EN = 1U << 0U;
constexpr std::uint32_t AHB1ENR_DMAMUX1EN = 1U << 2U;
constexpr std::uint32_t AHB1ENR_CRCEN = 1U << 12U;
constexpr std::uint32_t AHB2ENR_GPIOAEN = 1U << 0U;
constexpr std::uint32_t AHB2ENR_GPIOBEN = 1U << 1U;
constexpr std::uint32_t AHB2ENR_GPIOCEN = 1U << 2U;
constexpr std::uint32_t AHB2ENR_ADC12EN = 1U << 13U;
constexpr std::uint32_t AHB2ENR_ADC345EN = 1U << 14U;
constexpr std::uint32_t AHB2ENR_DAC1EN = 1U << 16U;
constexpr std::uint32_t AHB2ENR_DAC2EN = 1U << 17U;
constexpr std::uint32_t AHB2ENR_DAC3EN = 1U << 18U;
constexpr std::uint32_t AHB2ENR_DAC4EN = 1U << 19U;
constexpr std::uint32_t APB1ENR1_TIM2EN = 1U << 0U;
constexpr std::uint32_t APB1ENR1_TIM6EN = 1U << 4U;
constexpr std::uint32_t APB1ENR1_CRSEN = 1U << 8U;
constexpr std::uint32_t APB1ENR1_USART2EN = 1U << 17U;
constexpr std::uint32_t APB1ENR1_USBEN = 1U << 23U;
constexpr std::uint32_t APB1ENR1_FDCANEN = 1U << 25U;
constexpr std::uint32_t APB1ENR1_PWREN = 1U << 28U;
constexpr std::uint32_t APB2ENR_SYSCFGEN = 1U << 0U;  // also the clock of the op-amps

constexpr std::uint32_t CCIPR_FDCANSEL = 3U << 24U;
constexpr std::uint32_t CCIPR_FDCANSEL_PCLK1 = 2U << 24U;
constexpr std::uint32_t CCIPR_CLK48SEL = 3U << 26U;  // 0: HSI48
constexpr std::uint32_t CCIPR_ADC12SEL = 3U << 28U;
constexpr std::uint32_t CCIPR_ADC12SEL_SYSCLK = 2U << 28U;
constexpr std::uint32_t CCIPR_ADC345SEL = 3U << 30U;
constexpr std::uint32_t CCIPR_ADC345SEL_SYSCLK = 2U << 30U;

constexpr std::uint32_t CSR_RMVF = 1U << 23U;
constexpr std::uint32_t CSR_PINRSTF = 1U << 26U;
constexpr std::uint32_t CSR_BORRSTF = 1U << 27U;
constexpr std::uint32_t CSR_SFTRSTF = 1U << 28U;
constexpr std::uint32_t CSR_IWDGRSTF = 1U << 29U;
constexpr std::uint32_t CSR_WWDGRSTF = 1U << 30U;

constexpr std::uint32_t CRRCR_HSI48ON = 1U << 0U;
constexpr std::uint32_t CRRCR_HSI48RDY = 1U << 1U;
}  // namespace rcc

}  // namespace tricoil::stm32g4

// Analog-to-digital converters (RM0440, chapter ADC).
#pragma once

#include <cstddef>
#include <cstdint>

namespace tricoil::stm32g4 {

struct AdcRegisters {
    volatile std::uint32_t ISR;
    volatile std::uint32_t IER;
    volatile std::uint32_t CR;
    volatile std::uint32_t CFGR;
    volatile std::uint32_t CFGR2;
    volatile std::uint32_t SMPR1;
    volatile std::uint32_t SMPR2;
    std::uint32_t reserved_0;
    volatile std::uint32_t TR1;
    std::uint32_t reserved_1[3];
    volatile std::uint32_t SQR1;
    std::uint32_t reserved_2[3];
    volatile std::uint32_t DR;
};
static_assert(offsetof(AdcRegisters, TR1) == 0x20);
static_assert(offsetof(AdcRegisters, SQR1) == 0x30);
static_assert(offsetof(AdcRegisters, DR) == 0x40);

/// Common registers of ADC1 and ADC2, or of ADC3, ADC4 and ADC5.
struct AdcCommonRegisters {
    std::uint32_t reserved[2];
    volatile std::uint32_t CCR;
};
static_assert(offsetof(AdcCommonRegisters, CCR) == 0x08);

constexpr std::uintptr_t kAdc1Base = 0x5000'0000;
constexpr std::uintptr_t kAdc12CommonBase = 0x5000'0300;
constexpr std::uintptr_t kAdc3Base = 0x5000'0400;
constexpr std::uintptr_t kAdc4Base = 0x5000'0500;
constexpr std::uintptr_t kAdc5Base = 0x5000'0600;
constexpr std::uintptr_t kAdc345CommonBase = 0x5000'0700;

namespace adc {
constexpr std::uint32_t ISR_ADRDY = 1U << 0U;
constexpr std::uint32_t ISR_EOC = 1U << 2U;
constexpr std::uint32_t ISR_EOS = 1U << 3U;
constexpr std::uint32_t ISR_OVR = 1U << 4U;
constexpr std::uint32_t ISR_AWD1 = 1U << 7U;
constexpr std::uint32_t IER_AWD1IE = 1U << 7U;

// CR: writing 1 sets a command bit; writing 0 has no effect.
constexpr std::uint32_t CR_ADEN = 1U << 0U;
constexpr std::uint32_t CR_ADSTART = 1U << 2U;
constexpr std::uint32_t CR_ADSTP = 1U << 4U;
constexpr std::uint32_t CR_ADVREGEN = 1U << 28U;
constexpr std::uint32_t CR_ADCAL = 1U << 31U;

constexpr std::uint32_t CFGR_DMAEN = 1U << 0U;
constexpr std::uint32_t CFGR_DMACFG_circular = 1U << 1U;
constexpr std::uint32_t CFGR_EXTSEL_TIM6 = 13U << 5U;  // the same for all five ADCs
constexpr std::uint32_t CFGR_EXTEN_rising = 1U << 10U;
constexpr std::uint32_t CFGR_OVRMOD_overwrite = 1U << 12U;
constexpr std::uint32_t CFGR_AWD1SGL = 1U << 22U;
constexpr std::uint32_t CFGR_AWD1EN = 1U << 23U;
constexpr unsigned CFGR_AWD1CH_Pos = 26;
constexpr std::uint32_t CFGR_JQDIS = 1U << 31U;

constexpr std::uint32_t CFGR2_ROVSE = 1U << 0U;
constexpr unsigned CFGR2_OVSR_Pos = 2;           // value n: 2^(n+1) conversions
constexpr std::uint32_t CFGR2_TROVS = 1U << 9U;  // one trigger per conversion

constexpr std::uint32_t SMPR_47_5_cycles = 4;
constexpr std::uint32_t SMPR_640_5_cycles = 7;

constexpr unsigned TR1_HT1_Pos = 16;
constexpr unsigned SQR1_SQ1_Pos = 6;
constexpr std::uint32_t CCR_CKMODE_HCLK_4 = 3U << 16U;
constexpr std::uint32_t CCR_VREFEN = 1U << 22U;     // the voltage reference is an input
constexpr std::uint32_t CCR_VSENSESEL = 1U << 23U;  // the temperature sensor is an input
}  // namespace adc

}  // namespace tricoil::stm32g4

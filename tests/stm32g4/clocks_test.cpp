// Clock start-up from reset to full speed, with working and with failing oscillators.
#include "drivers/stm32g4/clocks.hpp"

#include <gtest/gtest.h>

namespace tricoil::stm32g4 {
namespace {

/// A plain structure does not react, so the status bits that the hardware would set are set in advance.
struct Clocks {
    RccRegisters rcc{};
    PwrRegisters pwr{};
    FlashRegisters flash{};

    CoreClock start() { return start_core_clock(rcc, pwr, flash); }
};

TEST(Clocks, RunFromTheCrystalIfItStarts) {
    Clocks clocks;
    clocks.rcc.CR = rcc::CR_HSERDY | rcc::CR_PLLRDY;
    clocks.rcc.CFGR = rcc::CFGR_SWS_PLL;
    EXPECT_EQ(clocks.start(), CoreClock::crystal);
    EXPECT_EQ(clocks.rcc.PLLCFGR, 3U | 5U << 4U | 85U << 8U | 1U << 24U);  // 24 MHz / 6 * 85 / 2
    EXPECT_EQ(clocks.rcc.CFGR & rcc::CFGR_SW, rcc::CFGR_SW_PLL);
    EXPECT_EQ(clocks.rcc.CFGR & rcc::CFGR_HPRE, 0U);
    EXPECT_EQ(clocks.flash.ACR & flash::ACR_LATENCY, 4U);
    EXPECT_NE(clocks.rcc.CR & rcc::CR_CSSON, 0U);  // clock security system on
}

TEST(Clocks, RunFromTheInternalOscillatorIfTheCrystalDoesNotStart) {
    Clocks clocks;
    clocks.rcc.CR = rcc::CR_PLLRDY;
    clocks.rcc.CFGR = rcc::CFGR_SWS_PLL;
    EXPECT_EQ(clocks.start(), CoreClock::internal);
    EXPECT_EQ(clocks.rcc.PLLCFGR, 2U | 3U << 4U | 85U << 8U | 1U << 24U);  // 16 MHz / 4 * 85 / 2
    EXPECT_EQ(clocks.rcc.CR & (rcc::CR_HSEON | rcc::CR_CSSON), 0U);
}

TEST(Clocks, StaySlowWithoutThePll) {
    Clocks clocks;
    clocks.rcc.CR = rcc::CR_HSERDY;
    EXPECT_EQ(clocks.start(), CoreClock::unmultiplied);
    EXPECT_EQ(clocks.rcc.CFGR & rcc::CFGR_SW, 0U);
    EXPECT_EQ(clocks.rcc.CR & rcc::CR_PLLON, 0U);
    EXPECT_EQ(hertz_of(CoreClock::unmultiplied), 16'000'000U);
}

TEST(Clocks, StaySlowIfTheRegulatorIsNotReady) {
    Clocks clocks;
    clocks.rcc.CR = rcc::CR_HSERDY | rcc::CR_PLLRDY;
    clocks.pwr.SR2 = pwr::SR2_VOSF;
    EXPECT_EQ(clocks.start(), CoreClock::unmultiplied);
}

TEST(Clocks, UsbOscillatorThatDoesNotStartIsReported) {
    RccRegisters rcc{};
    EXPECT_EQ(start_usb_clock(rcc).code(), StatusCode::timed_out);
    rcc.CRRCR = rcc::CRRCR_HSI48RDY;
    rcc.CCIPR = rcc::CCIPR_CLK48SEL;
    EXPECT_TRUE(start_usb_clock(rcc).ok());
    EXPECT_EQ(rcc.CCIPR & rcc::CCIPR_CLK48SEL, 0U);
}

}  // namespace
}  // namespace tricoil::stm32g4

// Regulator, clocks and watchdog of the virtual board take their settings with a delay.
#include "sim/virtual_board/peripherals/iwdg.hpp"
#include "sim/virtual_board/peripherals/pwr.hpp"
#include "sim/virtual_board/peripherals/rcc.hpp"
#include "tests/virtual_board/peripherals_bench.hpp"

namespace tricoil::virtual_board {
namespace {

using PowerClockTest = PeripheralsTest;

TEST_F(PowerClockTest, TheRegulatorFollowsBoostModeWithADelay) {
    Pwr pwr(machine);
    EXPECT_NE(pwr.range(), Pwr::Range::boost);
    pwr.write(0x80, 0);
    EXPECT_EQ(pwr.read(0x14), 1U << 10U) << "VOSF";
    EXPECT_NE(pwr.range(), Pwr::Range::boost);
    pass(25e-6);
    EXPECT_EQ(pwr.read(0x14), 0U);
    EXPECT_EQ(pwr.range(), Pwr::Range::boost);
    pwr.write(0x00, 0x4200);
    EXPECT_EQ(pwr.range(), Pwr::Range::low_power_run);
}

TEST_F(PowerClockTest, TheWatchdogTakesItsSettingsWithADelay) {
    Iwdg watchdog(machine, [] {});
    watchdog.write(0x00, 0x5555);
    watchdog.write(0x04, 2);
    watchdog.write(0x08, 100);
    EXPECT_EQ(watchdog.read(0x0C), 3U) << "PVU, RVU";
    EXPECT_THROW(watchdog.write(0x08, 200), RunFailure);
    pass(200e-6);
    EXPECT_EQ(watchdog.read(0x0C), 0U);
    EXPECT_NO_THROW(watchdog.write(0x08, 200));
}

TEST_F(PowerClockTest, TheUsbOscillatorStartsWithADelay) {
    Rcc rcc(machine);
    rcc.write(0x98, 1);
    EXPECT_EQ(rcc.read(0x98), 1U);
    EXPECT_FALSE(rcc.has_48_mhz());
    pass(10e-6);
    EXPECT_EQ(rcc.read(0x98), 3U);
    EXPECT_TRUE(rcc.has_48_mhz());
    rcc.write(0x98, 0);
    EXPECT_FALSE(rcc.has_48_mhz());
}

TEST_F(PowerClockTest, PllOutputsMayChangeWhileThePllRuns) {
    Rcc rcc(machine);
    rcc.write(0x0C, 2U | 3U << 4U | 75U << 8U);
    rcc.write(0x00, 0x01000500);
    EXPECT_NO_THROW(rcc.write(0x0C, 2U | 3U << 4U | 75U << 8U | 1U << 24U));
    EXPECT_THROW(rcc.write(0x0C, 2U | 3U << 4U | 85U << 8U | 1U << 24U), RunFailure);
    EXPECT_THROW(rcc.write(0x08, 7), RunFailure) << "not locked yet";
    pass(50e-6);
    rcc.write(0x08, 7U | 4U << 8U);
    EXPECT_DOUBLE_EQ(rcc.core_hz(), 150e6);
    EXPECT_DOUBLE_EQ(rcc.apb_hz(Apb::one), 75e6);
    EXPECT_EQ(rcc.timer_ticks(Apb::one), ticks_of_cycle(150e6)) << "timers of a divided bus count twice as fast";
    EXPECT_THROW(rcc.write(0x00, 0x500), RunFailure) << "the PLL drives the processor";
}

}  // namespace
}  // namespace tricoil::virtual_board

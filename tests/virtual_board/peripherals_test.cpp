// Peripheral models have the chip's start-up delays, and report firmware that does not wait.
#include <gtest/gtest.h>

#include "sim/virtual_board/peripherals/iwdg.hpp"
#include "sim/virtual_board/peripherals/pwr.hpp"
#include "sim/virtual_board/peripherals/rcc.hpp"

namespace tricoil::virtual_board {
namespace {

struct PeripheralsTest : ::testing::Test {
    void pass(double seconds) { machine.events.advance(machine.events.now() + ticks(seconds)); }
    Machine machine;
};

TEST_F(PeripheralsTest, TheRegulatorFollowsBoostModeWithADelay) {
    Pwr pwr(machine);
    EXPECT_FALSE(pwr.is_boosted());
    pwr.write(0x80, 0);
    EXPECT_EQ(pwr.read(0x14), 1U << 10U) << "VOSF";
    EXPECT_FALSE(pwr.is_boosted());
    pass(25e-6);
    EXPECT_EQ(pwr.read(0x14), 0U);
    EXPECT_TRUE(pwr.is_boosted());
}

TEST_F(PeripheralsTest, TheWatchdogTakesItsSettingsWithADelay) {
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

TEST_F(PeripheralsTest, TheUsbOscillatorStartsWithADelay) {
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

}  // namespace
}  // namespace tricoil::virtual_board

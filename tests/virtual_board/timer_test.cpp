// Timers of the virtual board count, compare, capture, and trigger each other as on the chip.
#include <cstring>

#include "sim/virtual_board/peripherals/timer.hpp"
#include "tests/virtual_board/peripherals_bench.hpp"

namespace tricoil::virtual_board {
namespace {

constexpr double kHz = 170e6;

struct TimerTest : PeripheralsTest {
    TimerTest() {
        dma.controller(0).write(0x0C, 100);
        dma.controller(0).write(0x10, 0x20000000);
        dma.controller(0).write(0x14, 0x20000100);
        dma.multiplexer().write(0x00, 60);
        dma.controller(0).write(0x08, 1);
        timer.write(0x28, 169);  // counts microseconds
        timer.write(0x14, 1);
        timer.write(0x10, 0);
    }
    std::uint32_t dma_left() { return dma.controller(0).read(0x0C); }

    Timer timer{machine, dma, {16, 4, true, 28, {}, 60, 56, [] { return ticks_of_cycle(kHz); }}};
};

TEST_F(TimerTest, APreloadedPeriodTakesEffectAtTheUpdate) {
    timer.write(0x2C, 99);
    timer.write(0x00, 1U | 1U << 7U);
    timer.write(0x14, 1);
    timer.write(0x10, 0);
    timer.write(0x2C, 199);
    pass(101e-6);
    EXPECT_EQ(timer.read(0x10) & 1U, 1U) << "the old period";
    timer.write(0x10, 0);
    pass(150e-6);
    EXPECT_EQ(timer.read(0x10) & 1U, 0U) << "the new period";
    EXPECT_EQ(timer.read(0x24), 151U);
}

TEST_F(TimerTest, WithUpdatesDisabledThereIsNoFlagAndNoDma) {
    timer.write(0x2C, 99);
    timer.write(0x0C, 1U << 8U);  // UDE
    timer.write(0x00, 3);
    pass(250e-6);
    EXPECT_EQ(timer.read(0x10) & 1U, 0U);
    EXPECT_EQ(dma_left(), 100U);
    timer.write(0x00, 1);
    pass(100e-6);
    EXPECT_EQ(timer.read(0x10) & 1U, 1U);
    EXPECT_EQ(dma_left(), 99U) << "an update requests a transfer";
}

TEST_F(TimerTest, CountingDownRepeatingAndComparing) {
    timer.write(0x2C, 99);
    timer.write(0x30, 1);  // an update at every second overflow
    timer.write(0x34, 30);
    timer.write(0x0C, 2);
    timer.write(0x00, 1U << 4U);
    timer.write(0x14, 1);
    timer.write(0x10, 0);
    timer.write(0x00, 1U | 1U << 4U);
    pass(60e-6);
    EXPECT_EQ(timer.read(0x24), 39U);
    EXPECT_FALSE(is_pending(28));
    pass(11e-6);
    EXPECT_TRUE(is_pending(28)) << "CC1IF at 30";
    EXPECT_EQ(timer.read(0x10), 2U);
    pass(100e-6);
    EXPECT_EQ(timer.read(0x10) & 1U, 0U);
    pass(100e-6);
    EXPECT_EQ(timer.read(0x10) & 1U, 1U);
}

TEST_F(TimerTest, APeriodBelowTheCountIsRefused) {
    timer.write(0x2C, 999);
    timer.write(0x00, 1);
    pass(500e-6);
    EXPECT_THROW(timer.write(0x2C, 100), RunFailure);
}

TEST_F(TimerTest, CentreAlignedCountingMatchesOnTheChosenWay) {
    constexpr std::array<std::array<std::uint32_t, 2>, 3> kFlags{{{0, 1}, {1, 0}, {1, 1}}};  // CMS = 1 to 3; up, down
    for (std::uint32_t mode = 1; mode <= 3; ++mode) {
        timer.reset();
        timer.write(0x28, 169);
        timer.write(0x2C, 100);
        timer.write(0x34, 30);
        timer.write(0x48, 60);  // CCR5
        timer.write(0x00, mode << 5U);
        timer.write(0x14, 1);
        timer.write(0x10, 0);
        timer.write(0x00, 1U | mode << 5U);
        pass(99e-6);
        EXPECT_EQ(timer.read(0x24), 99U);
        EXPECT_EQ(timer.read(0x10) & 0x10002U, kFlags[mode - 1][0] * 0x10002U) << "up, CMS " << mode;
        pass(11e-6);
        EXPECT_EQ(timer.read(0x24), 90U);
        EXPECT_EQ(timer.read(0x00) & 0x10U, 0x10U) << "DIR";
        EXPECT_EQ(timer.read(0x10) & 1U, 1U) << "overflow";
        timer.write(0x10, 0);
        pass(89e-6);
        EXPECT_EQ(timer.read(0x24), 1U);
        EXPECT_EQ(timer.read(0x10) & 0x10002U, kFlags[mode - 1][1] * 0x10002U) << "down, CMS " << mode;
        pass(2e-6);
        EXPECT_EQ(timer.read(0x24), 1U);
        EXPECT_EQ(timer.read(0x10) & 1U, 1U) << "underflow";
    }
}

/// RM0440: with 4 in the last bits, periods 1, 5, 9 and 13 of 16 are one count longer.
TEST_F(TimerTest, DitheringMakesSomePeriodsLonger) {
    timer.write(0x2C, 9);
    timer.write(0x00, 1U << 12U);
    EXPECT_EQ(timer.read(0x2C), 9U << 4U) << "the chip shifts the value";
    timer.write(0x2C, 9U << 4U | 4U);
    timer.write(0x14, 1);
    timer.write(0x10, 0);
    timer.write(0x00, 1U << 12U | 1U);
    std::vector<unsigned> lengths(1, 0);
    for (int n = 0; n < 164; ++n) {
        pass(1e-6);
        ++lengths.back();
        if ((timer.read(0x10) & 1U) != 0) {
            timer.write(0x10, 0);
            lengths.push_back(0);
        }
    }
    EXPECT_THAT(lengths, ::testing::ElementsAre(11, 10, 10, 10, 11, 10, 10, 10, 11, 10, 10, 10, 11, 10, 10, 10, 0));
}

TEST_F(TimerTest, ADitheredTimerTakesPreloadedValuesOnlyAtTheUpdate) {
    constexpr std::uint32_t kSettings = 1U << 12U | 1U << 7U;
    timer.write(0x00, kSettings);
    timer.write(0x2C, 9U << 4U);
    timer.write(0x30, 1);  // an update at every second overflow
    timer.write(0x14, 1);
    timer.write(0x10, 0);
    timer.write(0x00, kSettings | 1U);
    timer.write(0x2C, 99U << 4U);
    pass(21.5e-6);
    EXPECT_EQ(timer.read(0x10) & 1U, 1U) << "the old period, twice";
    timer.write(0x10, 0);
    pass(50e-6);
    EXPECT_EQ(timer.read(0x10) & 1U, 0U);
    EXPECT_EQ(timer.read(0x24), 51U) << "the new period";
}

struct SlaveTest : TimerTest {
    SlaveTest() {
        slave.connect(0, timer);
        timer.write(0x2C, 9);
        timer.write(0x04, 2U << 4U);  // TRGO at the update
        slave.write(0x34, 3);
    }
    Timer slave{machine, dma, {32, 4, false, 29, {}, {}, {}, [] { return ticks_of_cycle(kHz); }}};
};

TEST_F(SlaveTest, CountsThePulsesOfAnotherTimer) {
    for (const std::uint32_t mode : {5U, 7U}) {  // gate, external clock
        slave.write(0x2C, 5);
        slave.write(0x08, mode);
        slave.write(0x00, 1);
        timer.write(0x00, 1);
        pass(20.5e-6);
        EXPECT_EQ(slave.read(0x24), 2U);
        EXPECT_EQ(slave.read(0x10) & 0x43U, 0x40U) << "TIF";
        pass(10e-6);
        EXPECT_EQ(slave.read(0x24), 3U);
        EXPECT_EQ(slave.read(0x10) & 0x43U, 0x42U) << "CC1IF";
        pass(30e-6);
        EXPECT_EQ(slave.read(0x24), 0U);
        EXPECT_EQ(slave.read(0x10) & 0x43U, 0x43U);
        timer.reset();
        slave.reset();
        timer.write(0x28, 169);
        timer.write(0x2C, 9);
        timer.write(0x14, 1);
        timer.write(0x04, 2U << 4U);
        slave.write(0x34, 3);
    }
}

TEST_F(SlaveTest, StartsOrRestartsAtAPulse) {
    slave.write(0x28, 169);
    slave.write(0x14, 1);
    slave.write(0x08, 6);
    timer.write(0x00, 1);
    pass(9.5e-6);
    EXPECT_EQ(slave.read(0x00), 0U);
    pass(3e-6);
    EXPECT_EQ(slave.read(0x00), 1U) << "started";
    EXPECT_EQ(slave.read(0x24), 2U);
    slave.write(0x08, 4);
    pass(9e-6);
    EXPECT_EQ(slave.read(0x24), 1U) << "from zero again";
    slave.write(0x08, 5U << 4U | 4U);  // a pin, which does not move
    pass(30e-6);
    EXPECT_EQ(slave.read(0x24), 31U);
    slave.write(0x08, 3);  // encoder
    pass(30e-6);
    EXPECT_EQ(slave.read(0x24), 31U);
}

TEST_F(SlaveTest, AnUpdateBySoftwareClearsThePrescaler) {
    slave.write(0x2C, 100);
    slave.write(0x28, 2);
    slave.write(0x14, 1);
    slave.write(0x08, 7);
    slave.write(0x00, 1);
    timer.write(0x00, 1);
    pass(20.5e-6);
    slave.write(0x14, 1);
    pass(20e-6);
    EXPECT_EQ(slave.read(0x24), 0U) << "two triggers of three";
    pass(10e-6);
    EXPECT_EQ(slave.read(0x24), 1U);
}

TEST_F(SlaveTest, TimersThatResetEachOtherWithoutEndAreRefused) {
    timer.connect(1, slave);
    timer.write(0x08, 1U << 4U | 4U);
    slave.write(0x08, 4);
    slave.write(0x04, 1U << 4U);
    EXPECT_NO_THROW(timer.write(0x14, 1)) << "TRGO of the slave is its start";
    slave.write(0x04, 2U << 4U);
    EXPECT_THROW(timer.write(0x14, 1), RunFailure);
}

TEST_F(TimerTest, CapturesBySoftwareAndKeepsTheRegisterReadOnly) {
    timer.write(0x18, 1);  // channel 1: input
    timer.write(0x34, 77);
    timer.write(0x00, 1);
    pass(40.5e-6);
    EXPECT_EQ(timer.read(0x10) & 2U, 0U) << "no compare";
    timer.write(0x14, 2);
    pass(5e-6);
    EXPECT_EQ(timer.read(0x10) & 2U, 2U);
    EXPECT_EQ(timer.read(0x34), 40U);
    EXPECT_EQ(timer.read(0x10) & 2U, 0U) << "reading takes the value";
}

struct CaptureTest : TimerTest {
    Ticks lsi = ticks_of_cycle(32e3);
    Timer measuring{machine,
                    dma,
                    {16,
                     1,
                     true,
                     25,
                     {},
                     {},
                     {},
                     [] { return ticks_of_cycle(kHz); },
                     [this](unsigned input) { return input == 6 ? lsi : Ticks{-1}; }}};
};

TEST_F(CaptureTest, CapturesEdgesOfAnInternalClock) {
    measuring.write(0x2C, 0xFFFF);
    measuring.write(0x5C, 6);              // LSI
    measuring.write(0x18, 1U | 3U << 2U);  // every eighth edge
    measuring.write(0x20, 1);
    measuring.write(0x00, 1);
    pass(251e-6);
    EXPECT_EQ(measuring.read(0x10), 2U);
    const std::uint32_t first = measuring.read(0x34);
    pass(250e-6);
    EXPECT_NEAR((measuring.read(0x34) - first) & 0xFFFFU, 250e-6 * kHz, 1);
    pass(500e-6);
    EXPECT_EQ(measuring.read(0x10) & 0x200U, 0x200U) << "CC1OF: the one before was not read";
    EXPECT_THROW(measuring.write(0x5C, 2), RunFailure) << "MCO";
}

TEST_F(CaptureTest, CapturesAClockWhileItRuns) {
    lsi = 0;
    measuring.write(0x2C, 0xFFFF);
    measuring.write(0x5C, 6);
    measuring.write(0x18, 1);
    measuring.write(0x20, 1);
    measuring.write(0x00, 1);
    pass(100e-6);
    EXPECT_EQ(measuring.read(0x10) & 2U, 0U);
    lsi = ticks_of_cycle(32e3);
    measuring.clock_changed();
    pass(32e-6);
    EXPECT_EQ(measuring.read(0x10) & 2U, 2U) << "switched on after TISEL";
    lsi = 0;
    measuring.clock_changed();
    (void)measuring.read(0x34);
    pass(100e-6);
    EXPECT_EQ(measuring.read(0x10) & 2U, 0U) << "off again";
}

TEST_F(TimerTest, LockedSettingsStayUntilTheReset) {
    timer.write(0x44, 1U << 8U | 100U);
    timer.write(0x44, 3U << 8U | 1U << 15U | 50U);
    EXPECT_EQ(timer.read(0x44), 1U << 15U | 1U << 8U | 100U) << "MOE is free, LOCK and DTG are not";
    timer.write(0x04, 1U << 8U);
    EXPECT_EQ(timer.read(0x04), 0U) << "OIS1";
    timer.reset();
    timer.write(0x44, 3U << 8U);
    timer.write(0x50, 0x7878);
    EXPECT_EQ(timer.read(0x50), 0U) << "CCMR3";
    timer.reset();
    timer.write(0x44, 50);
    EXPECT_EQ(timer.read(0x44), 50U);
}

/// As the vendor's HAL_TIM_DMABurst_WriteStart: ARR, RCR and CCR1 at one update.
TEST_F(TimerTest, ABurstWritesOneRegisterAfterTheOther) {
    machine.bus.attach({"TIM", 0x40012C00, 0x400, &timer, {}});
    constexpr std::array<std::uint32_t, 3> kWords{99, 0, 42};
    std::memcpy(machine.memory.at(0x20000000, sizeof kWords).data(), kWords.data(), sizeof kWords);
    Peripheral& dma_1 = dma.controller(0);
    dma_1.write(0x08, 0);
    dma_1.write(0x0C, 3);
    dma_1.write(0x10, 0x40012C00 + 0x3E0);
    dma_1.write(0x14, 0x20000000);
    dma_1.write(0x08, 1U | 1U << 4U | 1U << 7U | 2U << 8U | 2U << 10U);
    timer.write(0x3DC, 11U | 2U << 8U | 1U << 16U);
    timer.write(0x2C, 9);
    timer.write(0x0C, 1U << 8U);
    timer.write(0x00, 1);
    pass(11e-6);
    EXPECT_EQ(dma_left(), 0U);
    EXPECT_EQ(timer.read(0x2C), 99U);
    EXPECT_EQ(timer.read(0x34), 42U);
    pass(50e-6);
    EXPECT_EQ(timer.read(0x24), 51U);
}

/// As the vendor's HAL_TIM_DMABurst_ReadStart.
TEST_F(TimerTest, ABurstReadsOneRegisterAfterTheOther) {
    timer.write(0x2C, 9);
    timer.write(0x30, 3);
    timer.write(0x3DC, 11U | 1U << 8U);
    EXPECT_EQ(timer.read(0x3E0), 9U);
    EXPECT_EQ(timer.read(0x3E0), 3U);
    EXPECT_EQ(timer.read(0x3E0), 9U);
}

}  // namespace
}  // namespace tricoil::virtual_board

// Peripheral models behave as the chip: start-up delays, preloads, flags and interrupts. A wrong use ends the run.
#include <gmock/gmock.h>

#include <cstring>

#include "sim/virtual_board/links/can_wire.hpp"
#include "sim/virtual_board/peripherals/adc.hpp"
#include "sim/virtual_board/peripherals/dac.hpp"
#include "sim/virtual_board/peripherals/flash.hpp"
#include "sim/virtual_board/peripherals/iwdg.hpp"
#include "sim/virtual_board/peripherals/pwr.hpp"
#include "sim/virtual_board/peripherals/rcc.hpp"
#include "sim/virtual_board/peripherals/timer.hpp"
#include "sim/virtual_board/peripherals/usart.hpp"

namespace tricoil::virtual_board {
namespace {

constexpr double kHz = 170e6;

struct PeripheralsTest : ::testing::Test {
    void pass(double seconds) { machine.events.advance(machine.events.now() + ticks(seconds)); }
    [[nodiscard]] bool is_pending(int interrupt) { return machine.nvic.is_pending(kFirstInterrupt + interrupt); }

    Machine machine;
    Dma dma{machine};
};

TEST_F(PeripheralsTest, TheRegulatorFollowsBoostModeWithADelay) {
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

TEST_F(PeripheralsTest, PllOutputsMayChangeWhileThePllRuns) {
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

TEST_F(TimerTest, CapturesEdgesOfAnInternalClock) {
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
                     [](unsigned input) { return input == 6 ? ticks_of_cycle(32e3) : Ticks{-1}; }}};
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

TEST_F(TimerTest, LockedSettingsStayUntilTheReset) {
    timer.write(0x44, 1U << 8U | 100U);
    timer.write(0x44, 3U << 8U | 1U << 15U | 50U);
    EXPECT_EQ(timer.read(0x44), 1U << 15U | 1U << 8U | 100U) << "MOE is free, LOCK and DTG are not";
    timer.write(0x04, 1U << 8U);
    EXPECT_EQ(timer.read(0x04), 0U) << "OIS1";
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

struct AdcTest : PeripheralsTest {
    AdcTest() {
        adc.sample = [](Ticks) { return 0xABCU; };
        common.write(0x08, 1U << 16U);
        adc.write(0x08, 1U << 28U);
        pass(30e-6);
        adc.write(0x08, 1U << 28U | 1U << 31U);
        pass(30e-6);
        adc.write(0x08, 1U << 28U | 1U);
        pass(2e-6);
        adc.write(0x04, 1U << 2U);
    }
    AdcCommon common{[] { return ticks_of_cycle(40e6); }, [] { return Ticks{0}; }};
    Adc adc{machine, dma, common, {5, 18}};
};

TEST_F(AdcTest, ConversionEndsAtItsOwnTimeAndReadingClearsTheInterrupt) {
    adc.write(0x00, 1);  // ADRDY may be cleared before ADSTART
    adc.write(0x08, 1U << 28U | 1U << 2U);
    EXPECT_EQ(adc.read(0x00) & 4U, 0U);
    pass(15.0 / 40e6 + 1e-9);
    EXPECT_EQ(adc.read(0x00) & 0xCU, 0xCU) << "EOC, EOS";
    EXPECT_TRUE(is_pending(18));
    EXPECT_EQ(adc.read(0x40), 0xABCU);
    machine.nvic.unpend(kFirstInterrupt + 18);
    adc.write(0x08, 1U << 28U | 1U << 2U);
    pass(1e-6);
    EXPECT_TRUE(is_pending(18)) << "a new edge, because reading DR lowered the line";
}

/// RM0440, "ADC overrun (OVR, OVRMOD)".
TEST_F(AdcTest, AnOverrunKeepsTheUnreadResultAndDiscardsLaterOnesUntilItsFlagIsCleared) {
    std::uint32_t code = 1;
    adc.sample = [&](Ticks) { return code; };
    const auto convert = [&](std::uint32_t next) {
        code = next;
        adc.write(0x08, 1U << 28U | 1U << 2U);
        pass(1e-6);
    };
    convert(1);
    convert(2);
    EXPECT_EQ(adc.read(0x00) & 0x10U, 0x10U);
    EXPECT_EQ(adc.read(0x40), 1U);
    convert(3);
    EXPECT_EQ(adc.read(0x40), 1U) << "discarded, although the first result has been read";
    adc.write(0x00, 0x10);
    convert(4);
    EXPECT_EQ(adc.read(0x40), 4U);
    adc.write(0x0C, 0x80000000U | 1U << 12U);
    convert(5);
    convert(6);
    EXPECT_EQ(adc.read(0x00) & 0x10U, 0x10U);
    EXPECT_EQ(adc.read(0x40), 6U) << "OVRMOD: the newest result";
}

TEST_F(AdcTest, ResolutionAlignmentAndContinuousMode) {
    adc.write(0x0C, 0x80000000U | 1U << 3U | 1U << 13U | 1U << 12U | 1U << 15U);  // 10 bits, left
    adc.write(0x08, 1U << 28U | 1U << 2U);
    pass(1e-6);
    EXPECT_EQ(adc.read(0x40), (0xABCU >> 2U) << 6U);
    pass(1e-6);
    EXPECT_EQ(adc.read(0x00) & 4U, 4U) << "the next conversion";
    EXPECT_THROW(adc.write(0x0C, 0x80000000U), RunFailure) << "written while conversions run";
}

TEST_F(PeripheralsTest, DacOutputsAtASoftwareTrigger) {
    Dac dac(machine, dma, 54, {6, 7}, [] { return 16e6; });
    dac.write(0x00, 3);  // EN1, TEN1
    dac.write(0x08, 0x123);
    EXPECT_EQ(dac.code(0), 0U);
    dac.write(0x04, 1);
    EXPECT_EQ(dac.code(0), 0x123U);
}

TEST_F(PeripheralsTest, DacSawtoothHasTriggersForResetAndStep) {
    Dac dac(machine, dma, 54, {6, 7}, [] { return 16e6; });
    dac.write(0x58, 0x28U << 16U | 1U << 12U | 0x100U);  // upwards by 2.5 from 256
    dac.write(0x60, 4U | 7U << 8U);
    dac.write(0x00, 3U | 3U << 6U);
    dac.trigger(4);
    EXPECT_EQ(dac.read(0x2C), 0x100U);
    dac.trigger(7);
    EXPECT_EQ(dac.read(0x2C), 0x102U);
    dac.trigger(7);
    EXPECT_EQ(dac.read(0x2C), 0x105U);
    dac.write(0x60, 0);
    dac.write(0x04, 1U << 16U);  // a step by software
    EXPECT_EQ(dac.read(0x2C), 0x107U);
    dac.write(0x04, 1);
    EXPECT_EQ(dac.read(0x2C), 0x100U);
}

/// As in HAL_DACEx_SelfCalibrate: the flag tells whether the trimming is large enough.
TEST_F(PeripheralsTest, DacCalibrationFindsTheTrimming) {
    Dac dac(machine, dma, 54, {6, 7}, [] { return 16e6; });
    dac.write(0x38, 31);
    EXPECT_EQ(dac.read(0x34) >> 14U, 0U) << "without CEN1";
    dac.write(0x00, 1U << 14U);
    EXPECT_EQ(dac.read(0x34) >> 14U & 1U, 1U);
    dac.write(0x38, 15);
    EXPECT_EQ(dac.read(0x34) >> 14U & 1U, 0U);
}

struct UsartTest : PeripheralsTest {
    UsartTest() { usart.write(0x0C, 100); }
    Usart usart{machine, dma, {38, 26, 27, false, [] { return ticks_of_cycle(10e6); }, {}}};  // 10 us a bit
};

TEST_F(UsartTest, TwoStopBitsTakeOneMoreBit) {
    EXPECT_EQ(usart.byte_time(), ticks(100e-6));
    usart.write(0x04, 2U << 12U);
    EXPECT_EQ(usart.byte_time(), ticks(110e-6));
}

TEST_F(UsartTest, IdleLineInterruptsAfterOneFrame) {
    usart.write(0x00, 0x1DU);
    usart.receive(0x55);
    pass(90e-6);
    EXPECT_FALSE(is_pending(38));
    pass(20e-6);
    EXPECT_TRUE(is_pending(38));
    EXPECT_EQ(usart.read(0x1C) & 0x10U, 0x10U);
    usart.write(0x20, 0x10);
    EXPECT_EQ(usart.read(0x1C) & 0x10U, 0U);
}

TEST_F(UsartTest, FifoThresholdInterrupts) {
    usart.write(0x08, 1U << 26U | 1U << 28U);  // half full: 4 bytes
    usart.write(0x00, 1U << 29U | 5U);
    for (int n = 0; n < 3; ++n) {
        usart.receive(1);
    }
    EXPECT_FALSE(is_pending(38));
    usart.receive(1);
    EXPECT_TRUE(is_pending(38));
}

struct CanTest : PeripheralsTest {
    CanTest() {
        fdcan.write(0x18, 3);
        fdcan.write(0x1C, 9U << 16U | 13U << 8U | 1U);  // 170 MHz / 10 / 17: 1 Mbit/s
        fdcan.write(0x54, 0x2E1FFF);
        fdcan.write(0x5C, 3);
        wire.on_frame = [this](const CanFrame& frame) { sent.push_back(frame); };
    }
    void put(unsigned buffer, std::uint32_t id, std::uint32_t control) {
        fdcan.memory().write(0x278 + 72 * buffer, id);
        fdcan.memory().write(0x27C + 72 * buffer, control);
    }
    Fdcan fdcan{machine, {86, 87}, [] { return kHz; }};
    CanWire wire{machine, {&fdcan}};
    std::vector<CanFrame> sent;
};

TEST_F(CanTest, RemoteFramesAndTransmitEvents) {
    fdcan.write(0x18, 0);
    put(0, 1U << 29U | 0x55U << 18U, 1U << 23U | 0x77U << 24U);
    fdcan.write(0xCC, 1);
    pass(1e-3);
    ASSERT_EQ(sent.size(), 1U);
    EXPECT_TRUE(sent[0].remote);
    EXPECT_EQ(fdcan.read(0xE4) & 7U, 1U) << "TXEFS.EFFL";
    EXPECT_EQ(fdcan.memory().read(0x264) >> 24U, 0x77U);
    CanFrame remote{0x12, false, false, false, {}};
    remote.remote = true;
    wire.send(remote);
    pass(1e-3);
    EXPECT_EQ(fdcan.memory().read(0xB0), 1U << 29U | 0x12U << 18U);
}

TEST_F(CanTest, WithoutRetransmissionAFailedFrameEnds) {
    fdcan.write(0x18, 3U | 1U << 6U);
    fdcan.write(0x18, 1U << 6U);
    wire.has_other_nodes = false;
    put(0, 0x55U << 18U, 0);
    fdcan.write(0xCC, 1);
    pass(1e-3);
    EXPECT_EQ(fdcan.read(0xC8), 0U);
    EXPECT_EQ(fdcan.read(0xD8), 1U) << "TXBCF";
    EXPECT_EQ(fdcan.read(0xD4), 0U) << "TXBTO";
}

TEST_F(CanTest, PriorityMessagesInterruptOnTheirLine) {
    fdcan.write(0x80, 1U << 16U);
    fdcan.write(0x58, 4);  // SMSG on line 1
    fdcan.memory().write(0x00, 2U << 30U | 5U << 27U | 0x123U << 16U | 0x7FFU);
    fdcan.write(0x18, 0);
    wire.send({0x123, false, false, false, {1}});
    pass(1e-3);
    EXPECT_EQ(fdcan.read(0x88), 2U << 6U) << "HPMS: FIFO 0, index 0, filter 0";
    EXPECT_TRUE(is_pending(87));
}

TEST_F(CanTest, LostMessagesAreClearedByTheirFlag) {
    fdcan.write(0x18, 0);
    for (int n = 0; n < 4; ++n) {
        wire.send({0x123, false, false, false, {1}});
    }
    pass(1e-3);
    EXPECT_EQ(fdcan.read(0x90) >> 25U & 1U, 1U) << "RF0L";
    fdcan.write(0x50, 4);
    EXPECT_EQ(fdcan.read(0x90) >> 25U & 1U, 0U);
}

TEST_F(CanTest, SlowDataPhaseNeedsNoDelayCompensation) {
    fdcan.write(0x0C, 9U << 16U | 9U << 8U | 5U << 4U | 5U);  // 170 MHz / 10 / 17
    fdcan.write(0x18, 3U | 3U << 8U);
    fdcan.write(0x18, 3U << 8U);
    wire.set_rates({1e6, 1e6});
    put(0, 0x55U << 18U, 3U << 20U | 9U << 16U);
    fdcan.write(0xCC, 1);
    EXPECT_NO_THROW(pass(1e-3));
    ASSERT_EQ(sent.size(), 1U);
    EXPECT_TRUE(sent[0].fast);
    EXPECT_EQ(sent[0].data.size(), 12U);
}

TEST_F(CanTest, ABusAtAnotherRateIsRefused) {
    fdcan.write(0x18, 0);
    wire.set_rates({500e3, 500e3});
    put(0, 0x55U << 18U, 0);
    EXPECT_THROW(fdcan.write(0xCC, 1), RunFailure);
}

TEST_F(PeripheralsTest, FlashRowsAreProgrammedFast) {
    Flash flash(machine);
    flash.write(0x00, 0x00040200);  // data cache off
    flash.write(0x08, 0x45670123);
    flash.write(0x08, 0xCDEF89AB);
    flash.write(0x14, 1U << 18U);
    flash.other_bank().write(4, 0);
    EXPECT_EQ(flash.read(0x10), 1U << 5U) << "PGAERR: not the begin of a row";
    flash.write(0x10, 1U << 5U);
    for (std::uint32_t at = 0; at < 256; at += 4) {
        EXPECT_EQ(flash.read(0x10), 0U);
        flash.other_bank().write(at, at);
    }
    EXPECT_EQ(flash.read(0x10), 1U << 16U) << "BSY";
    pass(2e-3);
    EXPECT_EQ(flash.read(0x10), 0U);
    EXPECT_EQ(flash.other_bank().read(252), 252U);
    EXPECT_EQ(flash.other_bank().read(256), 0xFFFFFFFFU);
}

TEST_F(PeripheralsTest, OptionBytesHaveTheirOwnKeys) {
    Flash flash(machine);
    EXPECT_THROW(flash.write(0x0C, 0x08192A3B), RunFailure) << "the flash is locked";
    flash.write(0x08, 0x45670123);
    flash.write(0x08, 0xCDEF89AB);
    flash.write(0x0C, 0x08192A3B);
    flash.write(0x0C, 0x4C5D6E7F);
    EXPECT_EQ(flash.read(0x14), 0U);
    EXPECT_THROW(flash.write(0x0C, 0x08192A3B), RunFailure) << "not locked";
    EXPECT_THROW(flash.write(0x2C, 0), RunFailure) << "changes of option bytes are not in this model";
}

TEST_F(PeripheralsTest, FlashEndOfOperationNeedsItsInterruptEnable) {
    Flash flash(machine);
    flash.write(0x00, 0x00040200);  // data cache off
    flash.write(0x08, 0x45670123);
    flash.write(0x08, 0xCDEF89AB);
    flash.write(0x14, 1U << 15U);
    EXPECT_EQ(flash.read(0x14) >> 30U, 1U) << "writing 0 does not clear OPTLOCK";
    flash.write(0x14, 1U << 15U | 1U << 16U);
    pass(30e-3);
    EXPECT_EQ(flash.read(0x10), 0U) << "no PGSERR after the erase of the bank, no EOP without EOPIE";
    EXPECT_FALSE(is_pending(4));
    flash.write(0x14, 1U << 24U | 1U << 15U | 1U << 16U);
    pass(30e-3);
    EXPECT_EQ(flash.read(0x10), 1U);
    EXPECT_TRUE(is_pending(4));
}

}  // namespace
}  // namespace tricoil::virtual_board

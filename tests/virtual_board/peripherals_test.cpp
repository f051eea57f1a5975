// Peripheral models behave as the chip: start-up delays, preloads, flags and interrupts. A wrong use ends the run.
#include <gmock/gmock.h>

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

// Converters of the virtual board: regular and injected sequences.
#include "sim/virtual_board/peripherals/adc.hpp"
#include "tests/virtual_board/peripherals_bench.hpp"

namespace tricoil::virtual_board {
namespace {

constexpr std::uint32_t kOn = 1U << 28U;        // CR: regulator
constexpr std::uint32_t kSettings = 1U << 31U;  // CFGR: JQDIS

struct AdcTest : PeripheralsTest {
    AdcTest() {
        adc.sample = [](Ticks) { return 0xABCU; };
        common.write(0x08, 1U << 16U);
        adc.write(0x08, kOn);
        pass(30e-6);
        adc.write(0x08, kOn | 1U << 31U);
        pass(30e-6);
        adc.write(0x08, kOn | 1U);
        pass(2e-6);
        adc.write(0x04, 1U << 2U);
    }
    AdcCommon common{[] { return ticks_of_cycle(40e6); }, [] { return Ticks{0}; }};
    Adc adc{machine, dma, common, {5, 18}};
};

TEST_F(AdcTest, ConversionEndsAtItsOwnTimeAndReadingClearsTheInterrupt) {
    adc.write(0x00, 1);  // ADRDY may be cleared before ADSTART
    adc.write(0x08, kOn | 1U << 2U);
    EXPECT_EQ(adc.read(0x00) & 4U, 0U);
    pass(15.0 / 40e6 + 1e-9);
    EXPECT_EQ(adc.read(0x00) & 0xCU, 0xCU) << "EOC, EOS";
    EXPECT_TRUE(is_pending(18));
    EXPECT_EQ(adc.read(0x40), 0xABCU);
    machine.nvic.unpend(kFirstInterrupt + 18);
    adc.write(0x08, kOn | 1U << 2U);
    pass(1e-6);
    EXPECT_TRUE(is_pending(18)) << "a new edge, because reading DR lowered the line";
}

/// RM0440, "ADC overrun (OVR, OVRMOD)".
TEST_F(AdcTest, AnOverrunKeepsTheUnreadResultAndDiscardsLaterOnesUntilItsFlagIsCleared) {
    std::uint32_t code = 1;
    adc.sample = [&](Ticks) { return code; };
    const auto convert = [&](std::uint32_t next) {
        code = next;
        adc.write(0x08, kOn | 1U << 2U);
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
    adc.write(0x0C, kSettings | 1U << 12U);
    convert(5);
    convert(6);
    EXPECT_EQ(adc.read(0x00) & 0x10U, 0x10U);
    EXPECT_EQ(adc.read(0x40), 6U) << "OVRMOD: the newest result";
}

TEST_F(AdcTest, ResolutionAlignmentAndContinuousMode) {
    adc.write(0x0C, kSettings | 1U << 3U | 1U << 13U | 1U << 12U | 1U << 15U);  // 10 bits, left
    adc.write(0x08, kOn | 1U << 2U);
    pass(1e-6);
    EXPECT_EQ(adc.read(0x40), (0xABCU >> 2U) << 6U);
    pass(1e-6);
    EXPECT_EQ(adc.read(0x00) & 4U, 4U) << "the next conversion";
    EXPECT_THROW(adc.write(0x0C, kSettings), RunFailure) << "written while conversions run";
}

TEST_F(AdcTest, AContinuousSequenceIgnoresFurtherTriggers) {
    adc.write(0x0C, kSettings | 1U << 13U | 1U << 12U | 1U << 10U | 13U << 5U);
    adc.write(0x08, kOn | 1U << 2U);
    adc.trigger(13, 14);
    pass(0.2e-6);
    EXPECT_NO_THROW(adc.trigger(13, 14));
    pass(0.2e-6);
    EXPECT_EQ(adc.read(0x00) & 4U, 4U) << "the first trigger started it";
}

TEST_F(AdcTest, OversampledResultsHaveNoOffset) {
    adc.write(0x60, kSettings | 0xABU);  // OFFSET1_EN, channel 0
    for (const auto& [oversampled, result] : {std::pair{0U, 0xA11U}, {1U, 2 * 0xABCU}, {2U, 0xABCU}}) {
        adc.write(0x10, oversampled);
        adc.write(0x08, kOn | 1U << 2U);
        pass(1e-6);
        EXPECT_EQ(adc.read(0x40), result) << "bit 1: also of the injected group alone";
    }
}

/// Regular channel 1, injected channels 7 and 8; the code is the number of the channel. A conversion takes 0.375 us.
struct InjectedTest : AdcTest {
    InjectedTest() {
        adc.sample = [this](Ticks) { return scale * adc.channel(); };
        adc.write(0x30, 1U << 6U);
        adc.write(0x4C, kSequence);
    }
    std::uint32_t flags() { return adc.read(0x00) & 0x6CU; }
    static constexpr std::uint32_t kSequence = 1U | 7U << 9U | 8U << 15U;
    static constexpr std::uint32_t kTriggered = kSequence | 1U << 7U | 14U << 2U;
    std::uint32_t scale = 1;
};

TEST_F(InjectedTest, ASequenceInterruptsTheRegularConversionWhichStartsAgain) {
    adc.write(0x04, 1U << 6U);
    adc.write(0x08, kOn | 1U << 2U);
    pass(0.2e-6);
    adc.write(0x08, kOn | 1U << 3U);
    pass(0.3e-6);
    EXPECT_EQ(flags(), 0U) << "the regular conversion did not end";
    EXPECT_EQ(adc.read(0x08) & 0xCU, 0xCU) << "ADSTART, JADSTART";
    pass(0.1e-6);
    EXPECT_EQ(flags(), 0x20U) << "JEOC";
    EXPECT_EQ(adc.read(0x80), 7U);
    EXPECT_EQ(flags(), 0U) << "reading takes the result";
    EXPECT_FALSE(is_pending(18));
    pass(0.4e-6);
    EXPECT_EQ(flags(), 0x60U) << "JEOC, JEOS";
    EXPECT_TRUE(is_pending(18));
    EXPECT_EQ(adc.read(0x84), 8U);
    EXPECT_EQ(adc.read(0x08) & 0xCU, 4U);
    adc.write(0x00, 1U << 6U);
    EXPECT_EQ(flags(), 0U);
    pass(0.3e-6);
    EXPECT_EQ(flags(), 0U);
    pass(0.05e-6);
    EXPECT_EQ(flags(), 0xCU) << "EOC, EOS";
    EXPECT_EQ(adc.read(0x40), 1U);
}

TEST_F(InjectedTest, OneTriggerStartsTheInjectedSequenceAndThenTheRegularOne) {
    adc.write(0x0C, kSettings | 1U << 10U | 13U << 5U);
    adc.write(0x4C, kTriggered);
    adc.write(0x08, kOn | 1U << 2U);
    adc.write(0x08, kOn | 1U << 3U);
    pass(1e-6);
    EXPECT_EQ(flags(), 0U);
    adc.trigger(12, 13);
    adc.trigger(13, 14);
    EXPECT_THROW(adc.trigger(12, 14), RunFailure) << "before the end of the sequence";
    pass(0.8e-6);
    EXPECT_EQ(flags(), 0x60U);
    pass(0.375e-6);
    EXPECT_EQ(flags(), 0x6CU);
    EXPECT_EQ(adc.read(0x08) & 0xCU, 0xCU) << "both wait for triggers";
    adc.write(0x08, kOn | 1U << 5U);
    EXPECT_EQ(adc.read(0x08) & 0xCU, 4U) << "JADSTP";
    adc.write(0x00, 0x60);
    adc.trigger(12, 14);
    pass(1e-6);
    EXPECT_EQ(flags(), 0xCU);
}

TEST_F(InjectedTest, DiscontinuousModeConvertsOneChannelAtEachTrigger) {
    adc.write(0x0C, kSettings | 1U << 20U);
    adc.write(0x4C, kTriggered);
    adc.write(0x08, kOn | 1U << 3U);
    for (const std::uint32_t expected : {0x20U, 0x60U, 0x20U}) {
        adc.write(0x00, 0x60);
        adc.trigger(13, 14);
        pass(1e-6);
        EXPECT_EQ(flags(), expected);
    }
    EXPECT_EQ(adc.read(0x80), 7U);
    EXPECT_EQ(adc.read(0x84), 8U);
}

/// RM0440, CFGR2.ROVSM: the oversampler keeps its sum, or starts from zero after the injected sequence.
TEST_F(InjectedTest, OversamplingIsContinuedOrResumed) {
    constexpr std::array<std::array<std::uint32_t, 3>, 4> kExpected{{{1U, 202, 8},              // ROVSE: continued
                                                                     {1U | 1U << 10U, 400, 8},  // ROVSM: resumed
                                                                     {3U, 400, 4 * 8},          // JOVSE too: resumed
                                                                     {2U, 1, 4 * 8}}};          // JOVSE alone
    for (const auto& [scope, regular, injected] : kExpected) {
        scale = 1;
        adc.write(0x10, scope | 1U << 2U);  // four codes
        adc.write(0x08, kOn | 1U << 2U);
        pass(0.8e-6);
        adc.write(0x08, kOn | 1U << 3U);
        pass(is_set(scope, 1) ? 3.1e-6 : 0.8e-6);
        EXPECT_EQ(flags() & 0x60U, 0x60U);
        EXPECT_EQ(adc.read(0x84), injected) << "CFGR2 " << scope;
        scale = 100;
        pass(2e-6);
        EXPECT_EQ(adc.read(0x40), regular) << "CFGR2 " << scope;
        adc.write(0x00, 0x7F);
    }
}

TEST_F(InjectedTest, AnAutomaticSequenceFollowsTheRegularOne) {
    adc.write(0x0C, kSettings | 1U << 25U | 1U << 13U | 1U << 12U);
    EXPECT_THROW(adc.write(0x08, kOn | 1U << 3U), RunFailure) << "JADSTART";
    adc.write(0x08, kOn | 1U << 2U);
    pass(0.4e-6);
    EXPECT_EQ(flags(), 0xCU);
    EXPECT_EQ(adc.read(0x40), 1U);
    pass(0.75e-6);
    EXPECT_EQ(flags(), 0x68U);
    pass(0.375e-6);
    EXPECT_EQ(flags(), 0x6CU) << "continuous";
    adc.write(0x00, 0x7F);
    adc.write(0x08, kOn | 1U << 4U);
    pass(2e-6);
    EXPECT_EQ(flags(), 0U) << "ADSTP ends both";
    EXPECT_NO_THROW(adc.write(0x0C, kSettings | 1U << 25U));
    adc.write(0x08, kOn | 1U << 2U);
    pass(2e-6);
    EXPECT_EQ(flags(), 0x6CU) << "once, from the first channel on";
    EXPECT_EQ(adc.read(0x84), 8U);
}

TEST_F(InjectedTest, ASequenceAfterAStoppedOneBeginsWithItsFirstChannel) {
    adc.write(0x08, kOn | 1U << 3U);
    pass(0.5e-6);
    adc.write(0x08, kOn | 1U << 5U);  // in the second of two conversions
    adc.write(0x4C, 7U << 9U);
    adc.write(0x0C, kSettings | 1U << 25U);  // JAUTO
    adc.write(0x08, kOn | 1U << 2U);
    pass(2e-6);
    EXPECT_EQ(adc.read(0x80), 7U);
    EXPECT_EQ(adc.read(0x84), 0U);
}

TEST_F(InjectedTest, TheWatchdogGuardsInjectedResults) {
    adc.write(0x20, 7U << 16U);
    adc.write(0x0C, kSettings | 1U << 24U);
    adc.write(0x08, kOn | 1U << 3U);
    pass(0.4e-6);
    EXPECT_EQ(adc.read(0x00) & 0x80U, 0U);
    pass(0.4e-6);
    EXPECT_EQ(adc.read(0x00) & 0x80U, 0x80U) << "8 is above the limit";
}

TEST_F(InjectedTest, SettingsWithoutAModelAreRefused) {
    adc.write(0x4C, kTriggered + (1U << 7U));
    adc.write(0x08, kOn | 1U << 3U);
    EXPECT_THROW(adc.trigger(13, 14), RunFailure) << "falling edge";
    EXPECT_THROW(adc.write(0x4C, kSequence), RunFailure) << "JADSTART";
    EXPECT_THROW(adc.write(0x08, kOn | 2U), RunFailure) << "ADDIS";
    EXPECT_THROW(adc.write(0x80, 0), RunFailure) << "JDR1 is read-only";
    adc.write(0x08, kOn | 1U << 5U);
    adc.write(0x4C, kSequence);
    adc.write(0x0C, kSettings | 1U << 20U);
    EXPECT_THROW(adc.write(0x08, kOn | 1U << 3U), RunFailure) << "JDISCEN without a trigger";
    adc.write(0x08, kOn | 1U << 5U);
    adc.write(0x0C, 0);
    EXPECT_EQ(adc.read(0x4C), 0U) << "a change of JQDIS clears JSQR";
    EXPECT_THROW(adc.write(0x08, kOn | 1U << 3U), RunFailure) << "JQDIS";
}

}  // namespace
}  // namespace tricoil::virtual_board

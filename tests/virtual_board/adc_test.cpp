// Converters of the virtual board: regular sequences.
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

}  // namespace
}  // namespace tricoil::virtual_board

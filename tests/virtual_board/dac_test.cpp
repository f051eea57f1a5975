// DACs of the virtual board.
#include "sim/virtual_board/peripherals/dac.hpp"
#include "tests/virtual_board/peripherals_bench.hpp"

namespace tricoil::virtual_board {
namespace {

struct DacTest : PeripheralsTest {
    Dac dac{machine, dma, 54, {6, 7}, [] { return 16e6; }};
};

TEST_F(DacTest, OutputsAtASoftwareTrigger) {
    dac.write(0x00, 3);  // EN1, TEN1
    dac.write(0x08, 0x123);
    EXPECT_EQ(dac.code(0), 0U);
    dac.write(0x04, 1);
    EXPECT_EQ(dac.code(0), 0x123U);
}

TEST_F(DacTest, SawtoothHasTriggersForResetAndStep) {
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
TEST_F(DacTest, CalibrationFindsTheTrimming) {
    dac.write(0x38, 31);
    EXPECT_EQ(dac.read(0x34) >> 14U, 0U) << "without CEN1";
    dac.write(0x00, 1U << 14U);
    EXPECT_EQ(dac.read(0x34) >> 14U & 1U, 1U);
    dac.write(0x38, 15);
    EXPECT_EQ(dac.read(0x34) >> 14U & 1U, 0U);
}

}  // namespace
}  // namespace tricoil::virtual_board

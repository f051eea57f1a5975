// Serial ports of the virtual board.
#include "sim/virtual_board/peripherals/usart.hpp"
#include "tests/virtual_board/peripherals_bench.hpp"

namespace tricoil::virtual_board {
namespace {

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

}  // namespace
}  // namespace tricoil::virtual_board

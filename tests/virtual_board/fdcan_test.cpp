// CAN controllers of the virtual board, with their wire.
#include "sim/virtual_board/links/can_wire.hpp"
#include "tests/virtual_board/peripherals_bench.hpp"

namespace tricoil::virtual_board {
namespace {

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
    Fdcan fdcan{machine, {86, 87}, [] { return 170e6; }};
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

}  // namespace
}  // namespace tricoil::virtual_board

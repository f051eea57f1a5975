// Data of the USB port: endpoint registers, messages, halts, suspend and resets.
#include <random>

#include "tests/stm32g4/usb_fixture.hpp"

namespace tricoil::stm32g4 {
namespace {

using namespace usb;
using test::Bytes;
using test::Handshake;
using test::Usb;

TEST(UsbEndpoint, AWriteChangesOnlyTheIntendedBits) {
    for (unsigned now = 0; now <= 0xFFFF; ++now) {
        const auto old = static_cast<std::uint16_t>(now);
        ASSERT_EQ(test::after_write(old, EndpointChange(old).word()), old);
        const std::uint16_t taken = test::after_write(old, EndpointChange(old).take_received().word());
        ASSERT_EQ(taken, old & ~EP_CTR_RX);
        for (const EndpointState state :
             {EndpointState::disabled, EndpointState::stall, EndpointState::nak, EndpointState::valid}) {
            const std::uint16_t received = test::after_write(old, EndpointChange(old).receive(state).word());
            ASSERT_EQ((received & EP_STAT_RX) >> EP_STAT_RX_Pos, static_cast<int>(state));
            ASSERT_EQ(received & ~EP_STAT_RX, old & ~EP_STAT_RX);
            const std::uint16_t sent =
                test::after_write(old, EndpointChange(old).take_sent().send(state).restart_sending().word());
            ASSERT_EQ((sent & EP_STAT_TX) >> EP_STAT_TX_Pos, static_cast<int>(state));
            ASSERT_EQ(sent & ~EP_STAT_TX, old & ~(EP_STAT_TX | EP_CTR_TX | EP_DTOG_TX));
        }
    }
}

TEST_F(Usb, OpensWithPullUpInterruptsAndClockRecovery) {
    EXPECT_EQ(registers_.CNTR, 0xDC00);
    EXPECT_EQ(registers_.BCDR, 0x8000);
    EXPECT_EQ(crs_.CR, 0x2000U | 1U << 5U | 1U << 6U);
    EXPECT_EQ(crs_.CFGR, 0x2022BB7FU);
    EXPECT_EQ(port_.send(Bytes{1}).code(), StatusCode::not_ready) << "no host yet";
    port_.close();
    EXPECT_EQ(registers_.BCDR, 0);
    EXPECT_EQ(registers_.CNTR, CNTR_FRES | CNTR_PDWN);
    EXPECT_EQ(port_.send(Bytes{1}).code(), StatusCode::device_lost);
}

TEST_F(Usb, CarriesMessagesBothWays) {
    host_.enumerate();
    expect_works();
    std::mt19937 random(4);
    hal::ReceivedMessage received;
    for (std::size_t bytes = 1; bytes <= kBoardMessageBytes; bytes += 7) {
        Bytes message(bytes);
        for (auto& byte : message) {
            byte = static_cast<std::uint8_t>(random());
        }
        nvic_.ISPR[0] = 0;
        ASSERT_TRUE(port_.send(message).ok());
        EXPECT_EQ(nvic_.ISPR[0], 1U << 20U) << "interrupt 20 is pended";
        host_.interrupt();
        EXPECT_EQ(read_all(), test::framed(message));
        bool complete = false;
        const Bytes stream = test::framed(message);
        for (std::size_t at = 0; at < stream.size(); at += 13) {
            const auto begin = stream.begin() + static_cast<std::ptrdiff_t>(at);
            ASSERT_EQ(host_.out(1, {begin, stream.begin() + static_cast<std::ptrdiff_t>(std::min(at + 13, stream.size()))}),
                      Handshake::ack);
            complete = port_.receive(received).ok();
            host_.interrupt();
        }
        ASSERT_TRUE(complete);
        EXPECT_EQ(Bytes(received.bytes.begin(), received.bytes.end()), message);
    }
    EXPECT_EQ(port_.wire_errors().total(), 0U);
}

TEST_F(Usb, EndsAFullLastPacketWithAnEmptyOne) {
    host_.enumerate();
    Bytes message(64 - 6, 7);
    ASSERT_EQ(test::framed(message).size(), 64U);
    ASSERT_TRUE(port_.send(message).ok());
    host_.interrupt();
    Bytes packet;
    EXPECT_EQ(host_.in(1, packet), Handshake::ack);
    EXPECT_EQ(packet.size(), 64U);
    EXPECT_EQ(host_.in(1, packet), Handshake::ack);
    EXPECT_TRUE(packet.empty());
    EXPECT_EQ(host_.in(1, packet), Handshake::nak);
}

TEST_F(Usb, AnEmptyPacketFromTheHostIsIgnored) {
    host_.enumerate();
    EXPECT_EQ(host_.out(1, {}), Handshake::ack);
    expect_works();
}

TEST_F(Usb, SendsNakWhileFullAndLosesNothing) {
    host_.enumerate();
    Bytes stream;
    for (std::uint8_t i = 0; i < 12; ++i) {
        const Bytes one = test::framed(Bytes(40, i));
        stream.insert(stream.end(), one.begin(), one.end());
    }
    hal::ReceivedMessage received;
    std::uint8_t next = 0;
    int naks = 0;
    for (std::size_t at = 0; at < stream.size();) {
        const std::size_t end = std::min(at + 64, stream.size());
        const auto begin = stream.begin();
        if (host_.out(1, {begin + static_cast<std::ptrdiff_t>(at), begin + static_cast<std::ptrdiff_t>(end)}) == Handshake::ack) {
            at = end;
            continue;
        }
        ++naks;
        ASSERT_LT(naks, 100);
        nvic_.ISPR[0] = 0;
        ASSERT_TRUE(port_.receive(received).ok());
        EXPECT_EQ(received.bytes[0], next++);
        EXPECT_NE(nvic_.ISPR[0], 0U) << "an interrupt is pended to resume reception";
        host_.interrupt();
    }
    while (port_.receive(received).ok()) {
        EXPECT_EQ(received.bytes[0], next++);
    }
    EXPECT_EQ(next, 12);
    EXPECT_GT(naks, 2);
    EXPECT_EQ(port_.counters().receive_dropped, 0U);
}

TEST_F(Usb, AHaltedEndpointStallsAndResumesWithoutLoss) {
    host_.enumerate();
    const Bytes message(30, 1);
    ASSERT_TRUE(port_.send(message).ok());
    host_.interrupt();
    ASSERT_TRUE(host_.control_out({2, 3, 0, 0, 0x81, 0, 0, 0}));
    EXPECT_EQ(host_.control_in({0x82, 0, 0, 0, 0x81, 0, 2, 0}).value(), (Bytes{1, 0}));
    EXPECT_EQ(host_.control_in({0x82, 0, 0, 0, 0x01, 0, 2, 0}).value(), (Bytes{0, 0}));
    Bytes packet;
    EXPECT_EQ(host_.in(1, packet), Handshake::stall);
    EXPECT_EQ(host_.out(1, {0}), Handshake::ack) << "the other direction goes on";
    ASSERT_TRUE(host_.control_out({2, 1, 0, 0, 0x81, 0, 0, 0}));
    EXPECT_EQ(read_all(), test::framed(message));

    ASSERT_TRUE(host_.control_out({2, 3, 0, 0, 0x01, 0, 0, 0}));
    EXPECT_EQ(host_.out(1, {1}), Handshake::stall);
    ASSERT_TRUE(host_.control_out({2, 1, 0, 0, 0x01, 0, 0, 0}));
    host_.forget_toggles();
    ASSERT_TRUE(host_.control_out({2, 1, 0, 0, 0x81, 0, 0, 0}));
    expect_works();
}

TEST_F(Usb, SendsNothingWhileSuspended) {
    host_.enumerate();
    host_.interrupt(ISTR_SUSP);
    EXPECT_EQ(registers_.CNTR, 0xDC00 | CNTR_FSUSP);
    EXPECT_EQ(port_.send(Bytes{1}).code(), StatusCode::not_ready);
    host_.interrupt(ISTR_WKUP);
    EXPECT_EQ(registers_.CNTR, 0xDC00);
    expect_works();
    EXPECT_EQ(port_.counters().link_losses, 1U);
    host_.interrupt(ISTR_SUSP);
    host_.interrupt(ISTR_WKUP);
    host_.enumerate();
    expect_works();
}

TEST_F(Usb, SurvivesResetsAtAnyTime) {
    std::mt19937 random(5);
    host_.enumerate();
    Bytes packet;
    for (int i = 0; i < 3000; ++i) {
        switch (random() % 8) {
            case 0:
                host_.reset();
                break;
            case 1:
                host_.setup({0xC0, 0x20, 0, 0, 7, 0, 162, 0});
                break;
            case 2:
                host_.in(0, packet);
                break;
            case 3:
                (void)port_.send(Bytes(1 + random() % 300, 3));
                host_.interrupt();
                break;
            case 4:
                host_.in(1, packet);
                break;
            case 5:
                host_.out(1, Bytes(1 + random() % 64, 9));
                break;
            case 6:
                host_.interrupt(random() % 2 == 0 ? ISTR_SUSP : ISTR_WKUP);
                break;
            default:
                host_.setup({0, 9, 1, 0, 0, 0, 0, 0});
                host_.forget_toggles();
        }
        if (i % 100 == 99) {
            for (int storm = 0; storm < 50; ++storm) {
                host_.reset();
            }
            host_.enumerate();
            hal::ReceivedMessage received;
            while (port_.receive(received).ok() || port_.wait(Microseconds{5}).ok()) {
            }
            host_.interrupt();
            expect_works();
        }
    }
    EXPECT_GT(port_.counters().link_losses, 100U);
}

TEST_F(Usb, QueuedMessagesAreDroppedWithTheirHost) {
    host_.enumerate();
    ASSERT_TRUE(port_.send(Bytes(200, 1)).ok());
    host_.interrupt();
    ASSERT_TRUE(write_all({5, 5, 5}));  // the beginning of a frame
    host_.enumerate();
    expect_works();
    EXPECT_EQ(port_.wire_errors().total(), 1U) << "the incomplete frame, not the message after it";
}

}  // namespace
}  // namespace tricoil::stm32g4

// The USB port against plain structures: toggle bits of the endpoint registers, enumeration bytes, halts, floods and resets.
#include "drivers/stm32g4/usb/usb_port.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "tests/stm32g4/stepping_clock.hpp"
#include "tests/stm32g4/usb_host.hpp"

namespace tricoil::stm32g4 {
namespace {

using namespace usb;
using test::Bytes;
using test::Handshake;
using Request = std::array<std::uint8_t, 8>;

TEST(UsbEndpoint, AWriteChangesOnlyTheIntendedBits) {
    for (unsigned now = 0; now <= 0xFFFF; ++now) {
        const auto old = static_cast<std::uint16_t>(now);
        ASSERT_EQ(test::after_write(old, EndpointChange(old).word()), old);
        const std::uint16_t taken = test::after_write(old, EndpointChange(old).take_received().word());
        ASSERT_EQ(taken, old & ~EP_CTR_RX);
        for (const EndpointState state :
             {EndpointState::disabled, EndpointState::stall, EndpointState::nak, EndpointState::valid}) {
            const std::uint16_t received = test::after_write(old, EndpointChange(old).receive(state).word());
            ASSERT_EQ(receive_state(received), state);
            ASSERT_EQ(received & ~EP_STAT_RX, old & ~EP_STAT_RX);
            const std::uint16_t sent =
                test::after_write(old, EndpointChange(old).take_sent().send(state).restart_sending().word());
            ASSERT_EQ(send_state(sent), state);
            ASSERT_EQ(sent & ~EP_STAT_TX, old & ~(EP_STAT_TX | EP_CTR_TX | EP_DTOG_TX));
        }
    }
}

class Usb : public testing::Test {
protected:
    void SetUp() override { ASSERT_TRUE(port_.open().ok()) << port_.detail(); }

    Bytes read_all() {
        Bytes stream;
        Bytes packet;
        while (host_.in(1, packet) == Handshake::ack) {
            stream.insert(stream.end(), packet.begin(), packet.end());
        }
        return stream;
    }

    /// Sends in packets of `size`; false if one was not taken.
    bool write_all(const Bytes& stream, std::size_t size = 64) {
        for (std::size_t at = 0; at < stream.size(); at += size) {
            const auto begin = stream.begin() + static_cast<std::ptrdiff_t>(at);
            const auto count = static_cast<std::ptrdiff_t>(std::min(size, stream.size() - at));
            if (host_.out(1, {begin, begin + count}) != Handshake::ack) {
                return false;
            }
        }
        return true;
    }

    void expect_works() {
        const Bytes message{1, 2, 0, 3};
        ASSERT_TRUE(port_.send(message).ok());
        host_.interrupt();
        EXPECT_EQ(read_all(), test::framed(message));
        ASSERT_TRUE(write_all(test::framed(message)));
        hal::ReceivedMessage received;
        ASSERT_TRUE(port_.receive(received).ok());
        EXPECT_EQ(Bytes(received.bytes.begin(), received.bytes.end()), message);
    }

    UsbRegisters registers_{};
    UsbPacketMemory memory_{};
    CrsRegisters crs_{0x2000, 0x1022BB7F, 0, 0};
    NvicRegisters nvic_{};
    test::SteppingClock clock_;
    UsbPort port_{registers_, memory_, crs_, {nvic_, kUsbLowPriorityInterrupt}, clock_, {0x0123'4567'89AB'CDEF}};
    test::UsbHost<UsbPort> host_{registers_, memory_, port_};
};

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

TEST_F(Usb, SendsItsDescriptors) {
    host_.reset();
    EXPECT_EQ(host_.control_in({0x80, 6, 0, 1, 0, 0, 64, 0}).value(),
              (Bytes{18, 1, 0x01, 0x02, 0xFF, 0, 0, 64, 0x09, 0x12, 0x01, 0x00, 0, 1, 1, 2, 3, 1}));
    EXPECT_EQ(host_.control_in({0x80, 6, 0, 2, 0, 0, 255, 0}).value(), (Bytes{9, 2, 32,   0, 1,  1,    0, 0xC0, 0,  //
                                                                              9, 4, 0,    0, 2,  0xFF, 0, 0,    2,  //
                                                                              7, 5, 0x81, 2, 64, 0,    0,           //
                                                                              7, 5, 0x01, 2, 64, 0,    0}));
    EXPECT_EQ(host_.control_in({0x80, 6, 0, 3, 0, 0, 255, 0}).value(), (Bytes{4, 3, 0x09, 0x04}));
    EXPECT_EQ(host_.control_in({0x80, 6, 1, 3, 9, 4, 255, 0}).value(),
              (Bytes{16, 3, 't', 0, 'r', 0, 'i', 0, 'c', 0, 'o', 0, 'i', 0, 'l', 0}));
    const Bytes serial = host_.control_in({0x80, 6, 3, 3, 9, 4, 255, 0}).value();
    ASSERT_EQ(serial.size(), 34U);
    EXPECT_EQ(serial[2], '0');
    EXPECT_EQ(serial[32], 'f');
    EXPECT_EQ(host_.control_in({0x80, 6, 0, 15, 0, 0, 255, 0}).value(),
              (Bytes{5,    15,   33,   0,    1,  //
                     28,   16,   5,    0,        //
                     0xDF, 0x60, 0xDD, 0xD8, 0x89, 0x45, 0xC7, 0x4C, 0x9C, 0xD2, 0x65, 0x9D,
                     0x9E, 0x64, 0x8A, 0x9F, 0,    0,    3,    6,    162,  0,    0x20, 0}));
}

TEST_F(Usb, SendsTheWinUsbDescriptor) {
    host_.reset();
    const Bytes set = host_.control_in({0xC0, 0x20, 0, 0, 7, 0, 162, 0}).value();
    ASSERT_EQ(set.size(), 162U) << "three packets";
    EXPECT_EQ(Bytes(set.begin(), set.begin() + 10), (Bytes{10, 0, 0, 0, 0, 0, 3, 6, 162, 0}));
    EXPECT_EQ(Bytes(set.begin() + 10, set.begin() + 30),
              (Bytes{20, 0, 3, 0, 'W', 'I', 'N', 'U', 'S', 'B', 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
    EXPECT_EQ(Bytes(set.begin() + 30, set.begin() + 40), (Bytes{132, 0, 4, 0, 7, 0, 42, 0, 'D', 0}));
    EXPECT_EQ(Bytes(set.begin() + 78, set.begin() + 84), (Bytes{0, 0, 80, 0, '{', 0})) << "name ends, length of the data";
    EXPECT_EQ(Bytes(set.end() - 6, set.end()), (Bytes{'}', 0, 0, 0, 0, 0})) << "a string list ends with two zeros";
    EXPECT_FALSE(host_.control_in({0xC0, 0x20, 0, 0, 4, 0, 255, 0}).has_value());
    EXPECT_FALSE(host_.control_in({0xC0, 0x21, 0, 0, 7, 0, 255, 0}).has_value());
}

TEST_F(Usb, SendsNoMoreThanRequested) {
    host_.reset();
    for (const std::uint8_t length : std::array<std::uint8_t, 5>{1, 8, 9, 17, 18}) {
        EXPECT_EQ(host_.control_in({0x80, 6, 0, 1, 0, 0, length, 0}).value().size(), length);
    }
    EXPECT_EQ(host_.control_in({0xC0, 0x20, 0, 0, 7, 0, 64, 0}).value().size(), 64U);
    EXPECT_EQ(host_.control_in({0xC0, 0x20, 0, 0, 7, 0, 100, 0}).value().size(), 100U);
    EXPECT_TRUE(host_.control_in({0x80, 6, 0, 1, 0, 0, 0, 0}).value().empty());
}

TEST_F(Usb, TakesItsAddressAfterTheStatusStage) {
    host_.reset();
    EXPECT_EQ(registers_.DADDR, DADDR_EF);
    host_.setup({0, 5, 42, 0, 0, 0, 0, 0});
    EXPECT_EQ(registers_.DADDR, DADDR_EF);
    Bytes packet;
    EXPECT_EQ(host_.in(0, packet), Handshake::ack);
    EXPECT_EQ(registers_.DADDR, DADDR_EF | 42);
    host_.reset();
    EXPECT_EQ(registers_.DADDR, DADDR_EF);
}

TEST_F(Usb, AnswersTheOtherStandardRequests) {
    host_.enumerate();
    EXPECT_EQ(host_.control_in({0x80, 0, 0, 0, 0, 0, 2, 0}).value(), (Bytes{1, 0})) << "self-powered";
    EXPECT_EQ(host_.control_in({0x81, 0, 0, 0, 0, 0, 2, 0}).value(), (Bytes{0, 0}));
    EXPECT_EQ(host_.control_in({0x82, 0, 0, 0, 0x81, 0, 2, 0}).value(), (Bytes{0, 0}));
    EXPECT_EQ(host_.control_in({0x80, 8, 0, 0, 0, 0, 1, 0}).value(), (Bytes{1}));
    EXPECT_EQ(host_.control_in({0x81, 10, 0, 0, 0, 0, 1, 0}).value(), (Bytes{0}));
    EXPECT_TRUE(host_.control_out({1, 11, 0, 0, 0, 0, 0, 0}));
    EXPECT_TRUE(host_.control_out({0, 9, 0, 0, 0, 0, 0, 0}));
    EXPECT_EQ(host_.control_in({0x80, 8, 0, 0, 0, 0, 1, 0}).value(), (Bytes{0}));
    Bytes packet;
    EXPECT_EQ(host_.in(1, packet), Handshake::none) << "switched off";
    EXPECT_EQ(host_.out(1, {1}), Handshake::none);
    EXPECT_EQ(port_.send(Bytes{1}).code(), StatusCode::not_ready);
}

TEST_F(Usb, StallsUnknownRequestsAndAnswersTheNext) {
    host_.enumerate();
    const std::vector<Request> unknown{
        {0x80, 6, 0, 6, 0, 0, 10, 0},     // device qualifier: no other speed
        {0x80, 6, 1, 2, 0, 0, 32, 0},     // a second configuration
        {0x80, 6, 9, 3, 9, 4, 64, 0},     // a ninth string
        {0, 9, 2, 0, 0, 0, 0, 0},         // configuration 2
        {0, 5, 128, 0, 0, 0, 0, 0},       // an address of eight bits
        {1, 11, 1, 0, 0, 0, 0, 0},        // alternate setting 1
        {0x81, 0, 0, 0, 1, 0, 2, 0},      // interface 1
        {0x82, 0, 0, 0, 0x82, 0, 2, 0},   // endpoint 2
        {0, 3, 1, 0, 0, 0, 0, 0},         // remote wake-up
        {0x82, 12, 0, 0, 0x81, 0, 2, 0},  // synchronisation frame
        {0x21, 0x20, 0, 0, 0, 0, 7, 0},   // of another class, with data
        {0, 7, 0, 1, 0, 0, 18, 0},        // set descriptor
        {0x80, 9, 1, 0, 0, 0, 0, 0},      // in the wrong direction
        {0x00, 6, 0, 1, 0, 0, 0, 0},      // likewise
    };
    Bytes packet;
    for (const Request& setup : unknown) {
        host_.setup(setup);
        EXPECT_EQ(host_.in(0, packet), Handshake::stall) << int{setup[0]} << ' ' << int{setup[1]};
        EXPECT_EQ(host_.out(0, {}), Handshake::stall);
        EXPECT_TRUE(host_.control_in({0x80, 8, 0, 0, 0, 0, 1, 0}).has_value());
    }
    EXPECT_EQ(registers_.DADDR, DADDR_EF | 5);
    expect_works();
}

TEST_F(Usb, ANewSetupEndsTheRequestInProgress) {
    host_.enumerate();
    host_.setup({0xC0, 0x20, 0, 0, 7, 0, 162, 0});
    Bytes packet;
    EXPECT_EQ(host_.in(0, packet), Handshake::ack);
    EXPECT_EQ(host_.control_in({0x80, 8, 0, 0, 0, 0, 1, 0}).value(), (Bytes{1}));
    host_.setup({0xC0, 0x20, 0, 0, 7, 0, 162, 0});
    EXPECT_EQ(host_.in(0, packet), Handshake::ack);
    EXPECT_EQ(host_.out(0, {}), Handshake::ack) << "the host ends the data stage early";
    host_.setup({0, 5, 9, 0, 0, 0, 0, 0});
    EXPECT_EQ(host_.control_in({0x80, 8, 0, 0, 0, 0, 1, 0}).value(), (Bytes{1}));
    EXPECT_EQ(registers_.DADDR, DADDR_EF | 5) << "an address whose status was never fetched";
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

TEST_F(Usb, AnyRequestIsAnsweredOrStalled) {
    std::mt19937 random(6);
    host_.enumerate();
    Bytes packet;
    for (int i = 0; i < 50'000; ++i) {
        Request setup{};
        for (auto& byte : setup) {
            byte = static_cast<std::uint8_t>(random() % 3 == 0 ? random() : random() % 16);
        }
        setup[0] = static_cast<std::uint8_t>(random() % 2 == 0 ? setup[0] : (setup[0] & 3U) | (random() % 2) << 7U);
        host_.setup(setup);
        const Handshake answer = host_.in(0, packet);
        ASSERT_TRUE(answer == Handshake::ack || answer == Handshake::stall);
    }
    host_.enumerate();
    hal::ReceivedMessage received;
    (void)port_.receive(received);
    expect_works();
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

// Control requests of the USB port: enumeration, descriptors, standard requests, invalid requests.
#include <random>

#include "tests/stm32g4/usb_fixture.hpp"

namespace tricoil::stm32g4 {
namespace {

using namespace usb;
using test::Bytes;
using test::Handshake;
using test::Usb;
using Request = std::array<std::uint8_t, 8>;

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
        {0x80, 6, 9, 3, 9, 4, 64, 0},     // string 9
        {0, 9, 2, 0, 0, 0, 0, 0},         // configuration 2
        {0, 5, 128, 0, 0, 0, 0, 0},       // an address of eight bits
        {1, 11, 1, 0, 0, 0, 0, 0},        // alternate setting 1
        {0x81, 0, 0, 0, 1, 0, 2, 0},      // interface 1
        {0x82, 0, 0, 0, 0x82, 0, 2, 0},   // endpoint 2
        {0, 3, 1, 0, 0, 0, 0, 0},         // remote wake-up
        {0x82, 12, 0, 0, 0x81, 0, 2, 0},  // synchronisation frame
        {0x21, 0x20, 0, 0, 0, 0, 7, 0},   // of another class, with data stage
        {0, 7, 0, 1, 0, 0, 18, 0},        // set descriptor
        {0x80, 9, 1, 0, 0, 0, 0, 0},      // set configuration, wrong direction
        {0x00, 6, 0, 1, 0, 0, 0, 0},      // get descriptor, wrong direction
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
    EXPECT_EQ(registers_.DADDR, DADDR_EF | 5) << "address 9 has no effect without its status stage";
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

}  // namespace
}  // namespace tricoil::stm32g4

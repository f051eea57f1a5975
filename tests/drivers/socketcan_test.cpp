// CanPort on the kernel's virtual CAN interfaces: vcan0 (FD) and vcan1 (classic).
#include <gmock/gmock.h>
#include <linux/can/error.h>

#include "core/protocol/codec.hpp"
#include "drivers/posix/monotonic_clock.hpp"
#include "drivers/socketcan/can_port.hpp"
#include "tests/drivers/shell.hpp"
#include "tests/protocol/random_messages.hpp"

namespace tricoil::drivers {
namespace {

using protocol::CommandMessage;
using protocol::PoseMessage;
using protocol::WireError;
using test::bytes_of;

class Can : public ::testing::Test {
protected:
    void SetUp() override {
        test::shell("ip link set vcan0 up");
        ASSERT_TRUE(host.open().ok()) << host.detail();
        ASSERT_TRUE(device.open().ok()) << device.detail();
    }

    /// Next message at `port`; empty after 0.1 s without one.
    static std::vector<std::uint8_t> next(CanPort& port, hal::ReceivedMessage* full = nullptr) {
        hal::ReceivedMessage message;
        for (int i = 0; i < 20; ++i) {
            if (port.receive(message).ok()) {
                if (full != nullptr) {
                    *full = message;
                }
                return {message.bytes.begin(), message.bytes.end()};
            }
            (void)port.wait(Microseconds{5000});
        }
        return {};
    }

    /// Sends a long message while both ends are served; returns the received message.
    std::vector<std::uint8_t> carry_long(const std::vector<std::uint8_t>& message) {
        EXPECT_TRUE(device.send(message).ok());
        hal::ReceivedMessage received;
        for (int i = 0; i < 400; ++i) {
            if (host.receive(received).ok()) {
                return {received.bytes.begin(), received.bytes.end()};
            }
            hal::ReceivedMessage none;
            (void)device.receive(none);
            (void)device.wait(Microseconds{200});
        }
        return {};
    }

    CanPort host{{"vcan0", 3, CanSide::host}};
    CanPort device{{"vcan0", 3, CanSide::device}};
};

TEST_F(Can, CarriesMessagesBothWaysWithArrivalTimes) {
    std::mt19937_64 random(1);
    const auto pose = bytes_of(test::random_message<PoseMessage>(random));
    const HostTime before = host_now();
    ASSERT_TRUE(device.send(pose).ok());
    hal::ReceivedMessage message;
    EXPECT_EQ(next(host, &message), pose);
    EXPECT_GE(message.arrival, before - Microseconds{100});
    EXPECT_LE(message.arrival, host_now());
    EXPECT_EQ(message.hardware_time_us, 0) << "a virtual controller has no clock";
    const auto command = bytes_of(CommandMessage{});
    CommandMessage hello;
    hello.opcode = 1;
    ASSERT_TRUE(host.send(bytes_of(hello)).ok());
    EXPECT_EQ(next(device), bytes_of(hello));
    EXPECT_EQ(host.counters().received, 1U);
    EXPECT_EQ(host.counters().sent, 1U);
}

TEST_F(Can, TheKernelFiltersOtherNodesAndForeignFrames) {
    CanPort other({"vcan0", 4, CanSide::device});
    ASSERT_TRUE(other.open().ok());
    std::mt19937_64 random(2);
    ASSERT_TRUE(other.send(bytes_of(test::random_message<PoseMessage>(random))).ok());
    test::shell("cansend vcan0 153##1DEADBEEF");  // a known identifier with invalid content
    test::shell("cansend vcan0 00000153#0102");   // the same number, extended
    test::shell("cansend vcan0 7FF#01");
    EXPECT_TRUE(next(host).empty());
    EXPECT_EQ(host.wire_errors().total(), 1U);
    EXPECT_EQ(host.counters().received, 0U);
}

TEST_F(Can, CarriesLongMessagesInSegments) {
    std::mt19937_64 random(3);
    for (const std::size_t tail : {100U, 492U, 3000U}) {
        const auto blob = test::random_bytes(tail, random);
        protocol::CalibrationMessage m;
        m.tail = blob;
        EXPECT_EQ(carry_long(bytes_of(m)), bytes_of(m)) << tail;
    }
    EXPECT_EQ(host.wire_errors().total(), 0U);
}

TEST_F(Can, IsCompatibleWithTheKernelsIsoTp) {
    // The kernel's ISO-TP receives segments from our device (node 3) and sends segments to our host.
    std::mt19937_64 random(4);
    const auto blob = test::random_bytes(300, random);
    protocol::CalibrationMessage m;
    m.tail = blob;
    const auto message = bytes_of(m);
    host.close();
    test::shell("isotprecv -s 1F3 -d 1E3 -L 72:64:1 vcan0 > /run/isotp &");
    ASSERT_TRUE(test::eventually([] { return test::read_text("/proc/net/can/rcvlist_sff").find("isotp") != std::string::npos; }));
    ASSERT_TRUE(device.send(message).ok());
    for (int i = 0; i < 40; ++i) {
        hal::ReceivedMessage none;
        (void)device.receive(none);
        (void)device.wait(Microseconds{5000});
    }
    std::ostringstream expected;
    for (const std::uint8_t byte : message) {
        expected << std::uppercase << std::hex << (byte >> 4U) << (byte & 15U) << ' ';
    }
    ASSERT_TRUE(test::eventually([] { return test::read_text("/run/isotp").size() > 100; }));
    EXPECT_EQ(test::read_text("/run/isotp"), expected.str() + "\n");

    ASSERT_TRUE(host.open().ok());
    test::write_text("/run/message", expected.str());
    test::shell("isotpsend -s 1E3 -d 1F3 -L 72:64:1 vcan0 < /run/message &");
    std::vector<std::uint8_t> received;
    EXPECT_TRUE(test::eventually([&] { return !(received = next(host)).empty(); }));
    EXPECT_EQ(received, message);
}

TEST_F(Can, ReceivesAgainAfterTheLinkWasDown) {
    std::mt19937_64 random(5);
    const auto pose = bytes_of(test::random_message<PoseMessage>(random));
    test::shell("ip link set vcan0 down");
    hal::ReceivedMessage none;
    EXPECT_EQ(host.receive(none).code(), StatusCode::not_ready) << "down, but not lost";
    EXPECT_EQ(host.link(), CanLink::down);
    EXPECT_NE(std::string(host.detail()), "");
    EXPECT_EQ(device.send(pose).code(), StatusCode::not_ready);
    EXPECT_EQ(device.counters().send_queue_full, 1U);
    const HostTime before = host_now();
    EXPECT_EQ(host.wait(Microseconds{20'000}).code(), StatusCode::timed_out);
    EXPECT_GT((host_now() - before).count(), 15'000) << "waits, does not spin";
    test::shell("ip link set vcan0 up");
    ASSERT_TRUE(device.send(pose).ok());
    EXPECT_EQ(next(host), pose);
    EXPECT_EQ(host.link(), CanLink::up);
    EXPECT_EQ(host.counters().link_losses, 1U);
}

TEST_F(Can, IsLostWithItsInterfaceAndComesBackWithIt) {
    test::shell("ip link add vcan7 type vcan; ip link set vcan7 mtu 72 up");
    CanPort port({"vcan7", 0, CanSide::host});
    ASSERT_TRUE(port.open().ok());
    test::shell("ip link del vcan7");
    hal::ReceivedMessage none;
    EXPECT_EQ(port.receive(none).code(), StatusCode::device_lost);
    EXPECT_EQ(port.open().code(), StatusCode::device_lost);
    EXPECT_THAT(port.detail(), ::testing::HasSubstr("vcan7: no such network interface"));
    test::shell("ip link add vcan7 type vcan; ip link set vcan7 mtu 72 up");
    EXPECT_TRUE(port.open().ok());
    test::shell("ip link del vcan7");
}

TEST_F(Can, BusOffStopsSendingUntilTheControllerRestarts) {
    const auto command = bytes_of(CommandMessage{});
    test::shell("cansend vcan0 20000040#0000000000000000");  // the kernel's error frame: bus-off
    hal::ReceivedMessage none;
    EXPECT_EQ(host.receive(none).code(), StatusCode::not_ready);
    EXPECT_EQ(host.link(), CanLink::bus_off);
    EXPECT_EQ(host.send(command).code(), StatusCode::not_ready);
    test::shell("cansend vcan0 20000100#0000000000000000");  // restarted
    EXPECT_EQ(host.receive(none).code(), StatusCode::not_ready);
    EXPECT_EQ(host.link(), CanLink::up);
    EXPECT_TRUE(host.send(command).ok());
}

TEST_F(Can, RefusesClassicAndNonCanInterfaces) {
    CanPort classic({"vcan1", 0, CanSide::host});
    EXPECT_EQ(classic.open().code(), StatusCode::device_lost);
    EXPECT_THAT(classic.detail(), ::testing::HasSubstr("vcan1 is a classic CAN interface"));
    CanPort loopback({"lo", 0, CanSide::host});
    EXPECT_FALSE(loopback.open().ok());
    EXPECT_STREQ(loopback.detail(), "lo is not a CAN interface");
    CanPort nameless({"", 0, CanSide::host});
    EXPECT_FALSE(nameless.open().ok());
    hal::ReceivedMessage none;
    EXPECT_EQ(nameless.receive(none).code(), StatusCode::device_lost);
    EXPECT_EQ(nameless.send(bytes_of(CommandMessage{})).code(), StatusCode::device_lost);
}

TEST_F(Can, CountsFramesDroppedByTheKernel) {
    std::mt19937_64 random(6);
    const auto pose = bytes_of(test::random_message<PoseMessage>(random));
    std::uint64_t sent = 0;
    for (int i = 0; i < 20'000; ++i) {
        sent += device.send(pose).ok() ? 1U : 0U;
    }
    std::uint64_t received = 0;
    hal::ReceivedMessage message;
    while (host.receive(message).ok()) {
        ++received;
    }
    ASSERT_TRUE(device.send(pose).ok());  // carries the kernel's drop count
    received += host.receive(message).ok() ? 1U : 0U;
    EXPECT_LT(received, sent) << "frames must have been dropped";
    EXPECT_EQ(received + host.counters().receive_dropped, sent + 1);
}

TEST_F(Can, OwnMessagesPassThroughAFlood) {
    // FD frames at the maximum rate with increasing identifiers and lengths.
    test::shell("timeout 2 cangen vcan0 -g 0 -I i -L i -f -p 1 > /dev/null 2>&1 & sleep 0.2");
    std::mt19937_64 random(7);
    for (int i = 0; i < 300; ++i) {
        PoseMessage m = test::random_message<PoseMessage>(random);
        const auto bytes = bytes_of(m);
        ASSERT_TRUE(test::eventually([&] { return device.send(bytes).ok(); }));
        bool found = false;
        for (int n = 0; n < 50 && !found; ++n) {
            found = next(host) == bytes;  // frames of the generator may have our identifiers, but contain no valid message
        }
        ASSERT_TRUE(found) << i;
    }
    EXPECT_GT(host.wire_errors().total(), 0U) << "the flood must reach the host";
}

}  // namespace
}  // namespace tricoil::drivers

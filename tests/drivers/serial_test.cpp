// Both ends of a pseudo terminal.
#include <gmock/gmock.h>

#include "core/protocol/codec.hpp"
#include "drivers/serial/serial_port.hpp"
#include "tests/protocol/random_messages.hpp"

namespace tricoil::drivers {
namespace {

using test::bytes_of;

std::vector<std::uint8_t> next(hal::MessagePort& port) {
    hal::ReceivedMessage message;
    for (int i = 0; i < 20; ++i) {
        if (port.receive(message).ok()) {
            return {message.bytes.begin(), message.bytes.end()};
        }
        (void)port.wait(Microseconds{5000});
    }
    return {};
}

TEST(Serial, CarriesMessagesOfEveryLengthBothWays) {
    PtyPort device;
    SerialPort host(device.path());
    ASSERT_TRUE(device.open().ok()) << device.detail();
    ASSERT_TRUE(host.open().ok()) << host.detail();
    std::mt19937_64 random(1);
    for (std::size_t bytes = 1; bytes < 3000; bytes += 173) {
        const auto message = test::random_bytes(bytes, random);
        ASSERT_TRUE(device.send(message).ok());
        EXPECT_EQ(next(host), message);
        ASSERT_TRUE(host.send(message).ok());
        EXPECT_EQ(next(device), message);
    }
    EXPECT_EQ(host.wire_errors().total(), 0U);
}

TEST(Serial, NeverBlocksOnAStalledLine) {
    PtyPort device;
    SerialPort host(device.path());
    ASSERT_TRUE(device.open().ok());
    ASSERT_TRUE(host.open().ok());
    const std::vector<std::uint8_t> message(1000, 7);
    StatusCode code = StatusCode::ok;
    for (int i = 0; i < 200 && code == StatusCode::ok; ++i) {
        code = device.send(message).code();
    }
    EXPECT_EQ(code, StatusCode::not_ready);
    EXPECT_EQ(device.counters().send_queue_full, 1U);
    EXPECT_EQ(next(host), message) << "a message accepted earlier arrives complete";
}

TEST(Serial, ReportsALostLineAndNamesWhatCannotBeOpened) {
    std::string path;
    SerialPort* host = nullptr;
    {
        PtyPort device;
        path = device.path();
        host = new SerialPort(path);
        ASSERT_TRUE(device.open().ok());
        ASSERT_TRUE(host->open().ok());
    }
    hal::ReceivedMessage none;
    EXPECT_EQ(host->receive(none).code(), StatusCode::device_lost);
    EXPECT_EQ(host->counters().link_losses, 1U);
    EXPECT_EQ(host->send(bytes_of(protocol::CommandMessage{})).code(), StatusCode::device_lost);
    delete host;
    SerialPort missing("/dev/no-such-line");
    EXPECT_EQ(missing.open().code(), StatusCode::device_lost);
    EXPECT_THAT(missing.detail(), ::testing::HasSubstr("/dev/no-such-line: cannot be opened"));
    SerialPort file("/dev/null");
    EXPECT_EQ(file.open().code(), StatusCode::device_lost);
    EXPECT_THAT(file.detail(), ::testing::HasSubstr("not a serial line"));
}

}  // namespace
}  // namespace tricoil::drivers

// Update of a device that answers wrongly.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <atomic>
#include <thread>

#include "board/linux/device_inquiry.hpp"
#include "board/support/errors.hpp"
#include "core/protocol/codec.hpp"
#include "core/protocol/stream_framing.hpp"

namespace tricoil {
namespace {

/// A device on a pseudo terminal. It acknowledges every part of an image as if it had only the first one.
class StuckDevice {
public:
    StuckDevice() {
        ::grantpt(terminal_);
        ::unlockpt(terminal_);
        ::termios raw{};
        ::tcgetattr(terminal_, &raw);
        ::cfmakeraw(&raw);
        ::tcsetattr(terminal_, TCSANOW, &raw);
        thread_ = std::thread([this] { serve(); });
    }
    StuckDevice(const StuckDevice&) = delete;
    StuckDevice& operator=(const StuckDevice&) = delete;
    ~StuckDevice() {
        stops_ = true;
        thread_.join();
        ::close(terminal_);
    }
    [[nodiscard]] std::string uri() const { return std::string("serial:") + ::ptsname(terminal_); }
    std::atomic<int> parts = 0;

private:
    void serve() {
        protocol::StreamReader reader;
        for (::pollfd ready{terminal_, POLLIN, 0}; !stops_; ::poll(&ready, 1, 10)) {
            std::uint8_t byte = 0;
            while ((ready.revents & POLLIN) != 0 && ::poll(&ready, 1, 0) > 0 && ::read(terminal_, &byte, 1) == 1) {
                if (reader.push(byte)) {
                    answer(reader.message());
                }
            }
        }
    }
    void answer(std::span<const std::uint8_t> bytes) {
        protocol::CommandMessage command;
        protocol::CalibrationMessage part;
        if (protocol::decode(bytes, command) == protocol::WireError::none) {
            protocol::IdentifyMessage identity;
            identity.role = static_cast<std::uint8_t>(protocol::Role::tracker);
            send(identity);
        } else if (protocol::decode(bytes, part) == protocol::WireError::none) {
            ++parts;
            protocol::AckMessage ack;
            ack.opcode = static_cast<std::uint8_t>(protocol::Opcode::write_calibration);
            ack.request = part.request;
            ack.argument = protocol::kImagePartBytes;
            send(ack);
        }
    }
    template <typename Message>
    void send(const Message& message) {
        std::array<std::uint8_t, protocol::kMaxFrameBytes> bytes{};
        const auto body = std::span(bytes).first(protocol::encode(message, bytes));
        std::vector<std::uint8_t> framed(protocol::framed_bytes(body.size()));
        framed.resize(protocol::frame(body, framed));
        ASSERT_EQ(::write(terminal_, framed.data(), framed.size()), std::ssize(framed));
    }

    int terminal_ = ::posix_openpt(O_RDWR | O_NOCTTY);
    std::atomic<bool> stops_ = false;
    std::thread thread_;
};

TEST(Update, EndsWhenTheDeviceRepeatsAnOffset) {
    StuckDevice device;
    linux_board::DeviceInquiry inquiry(device.uri(), 2);
    std::string error;
    try {
        inquiry.write_image(std::vector<std::uint8_t>(10 * protocol::kImagePartBytes));
    } catch (const host::DeviceError& e) {
        error = e.what();
    }
    EXPECT_THAT(error, ::testing::HasSubstr("the device has 592 bytes instead of 1184"));
    EXPECT_EQ(device.parts, 2);
}

}  // namespace
}  // namespace tricoil

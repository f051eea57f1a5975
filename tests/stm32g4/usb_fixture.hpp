// Fixture for tests of the USB port: registers as plain structures, and a simulated host.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/stm32g4/usb/usb_port.hpp"
#include "tests/stm32g4/stepping_clock.hpp"
#include "tests/stm32g4/usb_host.hpp"

namespace tricoil::test {

using namespace stm32g4;

/// Open port and the host at the other end.
class Usb : public testing::Test {
protected:
    void SetUp() override { ASSERT_TRUE(port_.open().ok()) << port_.detail(); }

    /// Reads until the endpoint has no more data.
    Bytes read_all() {
        Bytes stream;
        Bytes packet;
        while (host_.in(1, packet) == Handshake::ack) {
            stream.insert(stream.end(), packet.begin(), packet.end());
        }
        return stream;
    }

    /// Sends `stream` in packets of `size`; false if a packet was not accepted.
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

    /// A message passes in each direction.
    void expect_works() {
        const Bytes message{1, 2, 0, 3};
        ASSERT_TRUE(port_.send(message).ok());
        host_.interrupt();
        EXPECT_EQ(read_all(), framed(message));
        ASSERT_TRUE(write_all(framed(message)));
        hal::ReceivedMessage received;
        ASSERT_TRUE(port_.receive(received).ok());
        EXPECT_EQ(Bytes(received.bytes.begin(), received.bytes.end()), message);
    }

    UsbRegisters registers_{};
    UsbPacketMemory memory_{};
    CrsRegisters crs_{0x2000, 0x1022BB7F, 0, 0};
    NvicRegisters nvic_{};
    SteppingClock clock_;
    UsbPort port_{registers_, memory_, crs_, {nvic_, kUsbLowPriorityInterrupt}, clock_, {0x0123'4567'89AB'CDEF}};
    UsbHost<UsbPort> host_{registers_, memory_, port_};
};

}  // namespace tricoil::test

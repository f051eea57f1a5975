// UsbPort against a device whose transfers the test controls, and against the kernel's gadget stack.
#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <functional>

#include "core/protocol/codec.hpp"
#include "drivers/libusb/usb_port.hpp"
#include "drivers/posix/monotonic_clock.hpp"
#include "sim/usb/usbip_port.hpp"
#include "tests/drivers/gadget_port.hpp"
#include "tests/drivers/shell.hpp"
#include "tests/protocol/random_messages.hpp"

namespace tricoil::drivers {
namespace {

using sim::UsbIpPort;
using test::bytes_of;

/// Opens once the device has been enumerated.
::testing::AssertionResult open_soon(UsbPort& port) {
    return test::eventually([&] { return port.open().ok(); }) ? ::testing::AssertionSuccess()
                                                              : ::testing::AssertionFailure() << port.detail();
}

std::vector<std::uint8_t> next(UsbPort& port, int tries = 600) {
    hal::ReceivedMessage message;
    for (int i = 0; i < tries; ++i) {
        const Status status = port.receive(message);
        if (status.ok()) {
            return {message.bytes.begin(), message.bytes.end()};
        }
        if (status.code() == StatusCode::device_lost) {
            return {};
        }
        (void)port.wait(Microseconds{5000});
    }
    return {};
}

/// Device in its own thread: echoes every message, and runs the actions given to act().
class EchoDevice {
public:
    explicit EchoDevice(hal::MessagePort& port) : port_(port) {
        EXPECT_TRUE(port_.open().ok()) << port_.detail();
        thread_ = std::thread([this] { serve(); });
    }
    ~EchoDevice() {
        ending_ = true;
        thread_.join();
        port_.close();
        // The kernel does not enumerate a device that is plugged in while it still releases the previous one.
        EXPECT_TRUE(test::eventually([] { return std::system("grep -qs 1209 /sys/bus/usb/devices/*/idVendor") != 0; }));
    }
    void act(std::function<void()> action) {
        action_ = std::move(action);
        acting_ = true;
        while (acting_) {
            test::pause_ms(1);
        }
    }

private:
    void serve() {
        while (!ending_) {
            if (acting_) {
                action_();
                acting_ = false;
            }
            hal::ReceivedMessage message;
            if (port_.receive(message).ok()) {
                (void)port_.send(message.bytes);
            } else if (port_.wait(Microseconds{2000}).code() == StatusCode::device_lost) {
                test::pause_ms(1);
            }
        }
    }

    hal::MessagePort& port_;
    std::thread thread_;
    std::function<void()> action_;
    std::atomic<bool> acting_{false};
    std::atomic<bool> ending_{false};
};

TEST(Usb, CarriesMessagesOfEveryLength) {
    UsbIpPort device({});
    EchoDevice echo(device);
    UsbPort host(UsbAddress{});
    ASSERT_TRUE(open_soon(host));
    std::mt19937_64 random(1);
    for (const std::size_t bytes : {1U, 22U, 64U, 505U, 506U, 507U, 512U, 1019U, 4095U}) {
        const auto message = test::random_bytes(bytes, random);
        ASSERT_TRUE(host.send(message).ok());
        EXPECT_EQ(next(host), message) << bytes;
    }
    EXPECT_EQ(host.wire_errors().total(), 0U);
    EXPECT_EQ(host.counters().link_faults, 0U);
}

TEST(Usb, SurvivesFiftyReplugs) {
    UsbIpPort device({});
    UsbPort host(UsbAddress{});
    std::mt19937_64 random(2);
    const auto message = test::random_bytes(60, random);
    for (int i = 0; i < 50; ++i) {
        {
            EchoDevice echo(device);
            ASSERT_TRUE(open_soon(host)) << i;
            ASSERT_TRUE(host.send(message).ok());
            ASSERT_EQ(next(host), message) << i;
        }
        hal::ReceivedMessage none;
        ASSERT_TRUE(test::eventually([&] {
            (void)host.wait(Microseconds{5000});
            return host.receive(none).code() == StatusCode::device_lost;
        })) << i;
        ASSERT_EQ(host.send(message).code(), StatusCode::device_lost);
    }
    EXPECT_EQ(host.counters().link_losses, 50U);
}

TEST(Usb, RecoversFromStalls) {
    UsbIpPort device({});
    EchoDevice echo(device);
    UsbPort host(UsbAddress{});
    ASSERT_TRUE(open_soon(host));
    std::mt19937_64 random(3);
    const auto message = test::random_bytes(60, random);
    for (const int stalls : {1, 8, 20}) {
        const auto before = host.counters().link_faults;
        echo.act([&] { device.stall_next(stalls); });
        ASSERT_TRUE(test::eventually([&] {
            (void)host.wait(Microseconds{1000});
            hal::ReceivedMessage none;
            (void)host.receive(none);
            return host.counters().link_faults - before >= static_cast<std::uint64_t>(stalls);
        })) << stalls;
        ASSERT_TRUE(host.send(message).ok());
        EXPECT_EQ(next(host), message) << stalls;
    }
}

TEST(Usb, AStalledDeviceTimesOutWithoutBlocking) {
    UsbIpPort device({});
    EchoDevice echo(device);
    UsbPort host(UsbAddress{});
    ASSERT_TRUE(open_soon(host));
    echo.act([&] { device.hang(true); });
    std::mt19937_64 random(4);
    const auto message = test::random_bytes(60, random);
    const HostTime begin = host_now();
    StatusCode code = StatusCode::ok;
    for (int i = 0; i < 20; ++i) {
        code = host.send(message).code();
    }
    EXPECT_EQ(code, StatusCode::not_ready);
    EXPECT_LT((host_now() - begin).count(), 1'000'000) << "twenty time-outs would take four seconds";
    ASSERT_TRUE(test::eventually([&] {
        (void)host.wait(Microseconds{5000});
        return host.counters().link_faults >= 8;
    })) << "time-outs are reported";
    echo.act([&] { device.hang(false); });
    ASSERT_TRUE(test::eventually([&] {
        (void)host.wait(Microseconds{5000});
        return host.send(message).ok() && next(host, 5) == message;
    }));
}

TEST(Usb, ShortAndGarbledPacketsAreCountedAndTheNextMessageIsWhole) {
    UsbIpPort device({});
    EchoDevice echo(device);
    UsbPort host(UsbAddress{});
    ASSERT_TRUE(open_soon(host));
    std::mt19937_64 random(5);
    const auto message = test::random_bytes(300, random);
    std::vector<std::uint8_t> framed(protocol::framed_bytes(message.size()));
    framed.resize(protocol::frame(message, framed));
    echo.act([&] {
        device.send_packet({});                                      // empty
        device.send_packet({framed.begin(), framed.begin() + 100});  // a message in two packets
        device.send_packet({framed.begin() + 100, framed.end()});
        device.send_packet({9, 9, 9, 0});                           // garbage
        device.send_packet(std::vector<std::uint8_t>(4000, 0x55));  // longer than a packet
        device.send_packet({0});
        device.send_packet(framed);
    });
    EXPECT_EQ(next(host), message);
    EXPECT_EQ(next(host), message);
    EXPECT_GE(host.wire_errors().total(), 2U);
}

TEST(Usb, NamesAMissingOrForbiddenDevice) {
    UsbPort missing(UsbAddress{0x1209, 0x0001, ""});
    EXPECT_EQ(missing.open().code(), StatusCode::device_lost);
    EXPECT_THAT(missing.detail(), ::testing::HasSubstr("USB device 1209:0001: not found"));
    UsbIpPort device({});
    EchoDevice echo(device);
    UsbPort other(UsbAddress{0x1209, 0x0001, "ANOTHER"});
    UsbPort host(UsbAddress{0x1209, 0x0001, "SIM0001"});
    ASSERT_TRUE(open_soon(host));
    EXPECT_FALSE(other.open().ok());
    EXPECT_THAT(other.detail(), ::testing::HasSubstr("with serial number ANOTHER"));
    UsbPort second(UsbAddress{});
    EXPECT_FALSE(second.open().ok());
    EXPECT_THAT(second.detail(), ::testing::HasSubstr("another program uses it"));
    host.close();
    const auto listing = list_usb(0x1209, 0x0001);
    ASSERT_EQ(listing.size(), 1U);
    EXPECT_EQ(listing[0].serial, "SIM0001");
    // User nobody may read the device file, but not write it.
    test::shell("chmod 664 /dev/bus/usb/*/*");
    const pid_t child = ::fork();
    if (child == 0) {
        const bool dropped = ::setgid(65534) == 0 && ::setuid(65534) == 0;
        UsbPort denied(UsbAddress{});
        const bool refused = denied.open().code() == StatusCode::device_lost;
        ::_exit(dropped && refused && std::string(denied.detail()).find("70-tricoil.rules") != std::string::npos ? 0 : 1);
    }
    int status = -1;
    ::waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
}

TEST(UsbGadget, CarriesMessagesThroughTheKernelsGadgetStack) {
    sim::GadgetPort device({"/run/gadget", std::getenv("USB_GADGET"), "dummy_udc.0"});
    std::mt19937_64 random(6);
    for (int plugged = 0; plugged < 3; ++plugged) {
        UsbPort host(UsbAddress{});
        EchoDevice echo(device);
        ASSERT_TRUE(open_soon(host));
        for (const std::size_t bytes : {22U, 64U, 507U, 2000U}) {
            const auto message = test::random_bytes(bytes, random);
            ASSERT_TRUE(host.send(message).ok());
            EXPECT_EQ(next(host), message) << bytes;
        }
        EXPECT_EQ(host.wire_errors().total(), 0U);
    }
}

}  // namespace
}  // namespace tricoil::drivers

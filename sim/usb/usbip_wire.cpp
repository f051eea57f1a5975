#include "sim/usb/usbip_wire.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

namespace tricoil::sim {
namespace {

// Kernel documentation, Documentation/usb/usbip_protocol: headers of 48 bytes, big-endian.
constexpr std::size_t kHeader = 48;
constexpr std::uint32_t kSubmit = 1;
constexpr std::uint32_t kUnlink = 2;
constexpr std::uint32_t kSubmitted = 3;
constexpr std::uint32_t kUnlinked = 4;
constexpr unsigned kPorts = 8;
constexpr const char* kAttach = "/sys/devices/platform/vhci_hcd.0/attach";
constexpr int kAttachTries = 100;
constexpr unsigned kAttachPauseUs = 10'000;

std::uint32_t word(const std::uint8_t* at) {
    std::uint32_t value = 0;
    std::memcpy(&value, at, sizeof value);
    return ntohl(value);
}

void put_word(std::uint8_t* at, std::uint32_t value) {
    value = htonl(value);
    std::memcpy(at, &value, sizeof value);
}

}  // namespace

std::string UsbIpWire::unavailable_reason() {
    return ::access(kAttach, W_OK) == 0
               ? ""
               : "no writable virtual USB host controller; run modprobe vhci_hcd, and run this program as root";
}

std::string UsbIpWire::plug_in(UsbSpeed speed) {
    unplug();
    std::array<int, 2> ends{-1, -1};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
        return "cannot create a socket for the virtual USB device";
    }
    bool attached = false;
    for (int i = 0; i < kAttachTries && !attached; ++i) {
        // Each attempt uses the next port, because a port is not free at once after its device is unplugged.
        constexpr int kDeviceId = (1 << 16) | 2;
        const int port = static_cast<int>(attached_++ % kPorts);
        std::ofstream attach(kAttach);
        attach << port << ' ' << ends[1] << ' ' << kDeviceId << ' ' << static_cast<int>(speed) << std::flush;
        attached = attach.good();
        if (!attached) {
            ::usleep(kAttachPauseUs);
        }
    }
    ::close(ends[1]);
    if (!attached) {
        ::close(ends[0]);
        return "the virtual USB host controller refused the device; check that vhci_hcd is loaded and a port is free";
    }
    fd_ = ends[0];
    return "";
}

void UsbIpWire::unplug() {
    if (fd_ >= 0) {
        ::close(fd_);
    }
    fd_ = -1;
    input_.clear();
}

void UsbIpWire::answer(std::uint32_t number, int status, std::span<const std::uint8_t> data, std::size_t actual) {
    send(kSubmitted, number, status, data, actual);
}

void UsbIpWire::send(std::uint32_t command, std::uint32_t number, int status, std::span<const std::uint8_t> data,
                     std::size_t actual) {
    std::vector<std::uint8_t> bytes(kHeader);
    put_word(bytes.data(), command);
    put_word(bytes.data() + 4, number);
    put_word(bytes.data() + 20, static_cast<std::uint32_t>(status));
    put_word(bytes.data() + 24, static_cast<std::uint32_t>(actual));
    bytes.insert(bytes.end(), data.begin(), data.end());
    for (std::size_t at = 0; at < bytes.size() && fd_ >= 0;) {
        const ssize_t written = ::send(fd_, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
        if (written <= 0) {
            unplug();
            return;
        }
        at += static_cast<std::size_t>(written);
    }
}

void UsbIpWire::serve() {
    std::array<std::uint8_t, 16384> chunk{};
    while (fd_ >= 0) {
        const ssize_t bytes = ::recv(fd_, chunk.data(), chunk.size(), MSG_DONTWAIT);
        if (bytes == 0) {
            unplug();
            return;
        }
        if (bytes < 0) {
            break;
        }
        input_.insert(input_.end(), chunk.begin(), chunk.begin() + bytes);
    }
    std::size_t at = 0;
    for (std::size_t size = 1; fd_ >= 0 && size > 0; at += size) {
        size = take(std::span(input_).subspan(at));
    }
    input_.erase(input_.begin(), input_.begin() + static_cast<std::ptrdiff_t>(std::min(at, input_.size())));
}

/// Handles the first request of the input, if it is complete. Returns its size in bytes, or 0.
std::size_t UsbIpWire::take(std::span<const std::uint8_t> input) {
    if (input.size() < kHeader) {
        return 0;
    }
    const std::uint8_t* head = input.data();
    const std::uint32_t command = word(head);
    UsbIpRequest request{word(head + 4), word(head + 12) == 1, word(head + 16), word(head + 24), {}};
    std::copy_n(head + 40, request.setup.size(), request.setup.begin());
    const std::size_t data = command == kSubmit && !request.to_host ? request.length : 0;
    if (input.size() < kHeader + data) {
        return 0;
    }
    if (command == kUnlink) {
        send(kUnlinked, request.number, unlink_(word(head + 20)) ? -ECONNRESET : 0, {}, 0);
    } else {
        submit_(request, input.subspan(kHeader, data));
    }
    return kHeader + data;
}

}  // namespace tricoil::sim

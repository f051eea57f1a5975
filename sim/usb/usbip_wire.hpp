// USB/IP between this program and the kernel's virtual host controller: receives requests, sends answers.
#pragma once

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace tricoil::sim {

enum class UsbSpeed : std::uint8_t { full = 2, high = 3 };  // the kernel's numbers

/// One request of the host: a transfer, or the cancellation of one.
struct UsbIpRequest {
    std::uint32_t number = 0;
    bool to_host = false;
    std::uint32_t endpoint = 0;
    std::uint32_t length = 0;
    std::array<std::uint8_t, 8> setup{};
};

/// One device on the virtual host controller.
class UsbIpWire {
public:
    using Submit = std::function<void(const UsbIpRequest&, std::span<const std::uint8_t> data)>;
    /// Cancels the transfer with this number. True if the transfer was still pending.
    using Unlink = std::function<bool(std::uint32_t number)>;

    UsbIpWire(Submit submit, Unlink unlink) : submit_(std::move(submit)), unlink_(std::move(unlink)) {}
    ~UsbIpWire() { unplug(); }
    UsbIpWire(const UsbIpWire&) = delete;
    UsbIpWire& operator=(const UsbIpWire&) = delete;

    /// Empty if there is a host controller; otherwise the reason.
    static std::string unavailable_reason() {
        return ::access(kAttach, W_OK) == 0
                   ? ""
                   : "no writable virtual USB host controller; run modprobe vhci_hcd, and run this program as root";
    }
    /// Empty if the host controller accepted the device; otherwise the reason.
    std::string plug_in(UsbSpeed speed) {
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
    void unplug() {
        if (fd_ >= 0) {
            ::close(fd_);
        }
        fd_ = -1;
        input_.clear();
    }
    [[nodiscard]] bool is_plugged_in() const { return fd_ >= 0; }

    /// Handles all pending requests; never waits. Unplugs the device when the host has closed the connection.
    void serve() {
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
    /// `status`: 0, or a negative errno. `actual`: bytes moved.
    void answer(std::uint32_t number, int status, std::span<const std::uint8_t> data, std::size_t actual) {
        send(kSubmitted, number, status, data, actual);
    }
    /// For poll().
    [[nodiscard]] int fd() const { return fd_; }

private:
    // Kernel documentation, Documentation/usb/usbip_protocol: headers of 48 bytes, big-endian.
    static constexpr std::size_t kHeader = 48;
    static constexpr std::uint32_t kSubmit = 1;
    static constexpr std::uint32_t kUnlink = 2;
    static constexpr std::uint32_t kSubmitted = 3;
    static constexpr std::uint32_t kUnlinked = 4;
    static constexpr unsigned kPorts = 8;
    static constexpr const char* kAttach = "/sys/devices/platform/vhci_hcd.0/attach";
    static constexpr int kAttachTries = 100;
    static constexpr unsigned kAttachPauseUs = 10'000;
    static std::uint32_t word(const std::uint8_t* at) {
        std::uint32_t value = 0;
        std::memcpy(&value, at, sizeof value);
        return ntohl(value);
    }
    static void put_word(std::uint8_t* at, std::uint32_t value) {
        value = htonl(value);
        std::memcpy(at, &value, sizeof value);
    }

    /// Handles the first request of the input, if it is complete. Returns its size in bytes, or 0.
    std::size_t take(std::span<const std::uint8_t> input) {
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
    void send(std::uint32_t command, std::uint32_t number, int status, std::span<const std::uint8_t> data, std::size_t actual) {
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

    Submit submit_;
    Unlink unlink_;
    unsigned attached_ = 0;  // number of attempts
    int fd_ = -1;
    std::vector<std::uint8_t> input_;
};

}  // namespace tricoil::sim

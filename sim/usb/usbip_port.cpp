#include "sim/usb/usbip_port.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>

namespace tricoil::sim {
namespace {

// The kernel's Documentation/usb/usbip_protocol: headers of 48 bytes, big-endian.
constexpr std::size_t kHeader = 48;
constexpr std::uint32_t kSubmit = 1;
constexpr std::uint32_t kUnlink = 2;
constexpr std::uint32_t kSubmitted = 3;
constexpr std::uint32_t kUnlinked = 4;
constexpr std::size_t kPacket = 512;
constexpr std::size_t kMostPackets = 1024;
constexpr int kHighSpeed = 3;
constexpr unsigned kPorts = 8;
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

std::vector<std::uint8_t> text_descriptor(const std::string& text) {
    std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), 3};
    for (const char c : text) {
        bytes.push_back(static_cast<std::uint8_t>(c));
        bytes.push_back(0);
    }
    return bytes;
}

std::vector<std::uint8_t> descriptor(const UsbIpParams& params, int type, int index) {
    const auto low = [](std::uint16_t v) { return static_cast<std::uint8_t>(v); };
    const auto high = [](std::uint16_t v) { return static_cast<std::uint8_t>(v >> 8U); };
    switch (type) {
        case 1:
            return {
                18, 1, 0, 2, 0xFF, 0, 0, 64, low(params.vendor), high(params.vendor), low(params.product), high(params.product),
                0,  1, 1, 2, 3,    1};
        case 2:
            return {9, 2, 32, 0, 1, 1, 0, 0x80, 50, 9, 4, 0, 0, 2, 0xFF, 0, 0, 2, 7, 5, 0x81, 2, 0, 2, 0, 7, 5, 0x01, 2, 0, 2, 0};
        case 3:
            return index == 0   ? std::vector<std::uint8_t>{4, 3, 9, 4}
                   : index == 1 ? text_descriptor("tricoil")
                   : index == 2 ? text_descriptor("simulated front end")
                                : text_descriptor(params.serial);
        case 6:
            return {10, 6, 0, 2, 0xFF, 0, 0, 64, 1, 0};
        default:
            return {};
    }
}

}  // namespace

Status UsbIpPort::do_open() {
    do_close();
    std::array<int, 2> ends{-1, -1};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
        why() = "no socket for the virtual USB device";
        return {StatusCode::device_lost, "no socket"};
    }
    bool attached = false;
    for (int i = 0; i < kAttachTries && !attached; ++i) {
        // Another port each time: one is not free at once when its device has been pulled out.
        constexpr int kDeviceId = (1 << 16) | 2;
        const int port = static_cast<int>(attached_++ % kPorts);
        std::ofstream attach("/sys/devices/platform/vhci_hcd.0/attach");
        attach << port << ' ' << ends[1] << ' ' << kDeviceId << ' ' << kHighSpeed << std::flush;
        attached = attach.good();
        if (!attached) {
            ::usleep(kAttachPauseUs);
        }
    }
    ::close(ends[1]);
    if (!attached) {
        ::close(ends[0]);
        why() = "the virtual USB host controller does not take the device; is vhci_hcd there, and the port free?";
        return {StatusCode::device_lost, "no virtual host controller"};
    }
    fd_ = ends[0];
    why().clear();
    return {};
}

void UsbIpPort::do_close() {
    if (fd_ >= 0) {
        ::close(fd_);
    }
    fd_ = -1;
    input_.clear();
    pending_.clear();
    packets_.clear();
    forget_arrived();
    withheld_.clear();
    reader_.reset();
}

void UsbIpPort::answer(std::uint32_t command, std::uint32_t number, int status, std::span<const std::uint8_t> data,
                       std::size_t actual) {
    std::vector<std::uint8_t> bytes(kHeader);
    put_word(bytes.data(), command);
    put_word(bytes.data() + 4, number);
    put_word(bytes.data() + 20, static_cast<std::uint32_t>(status));
    put_word(bytes.data() + 24, static_cast<std::uint32_t>(actual));
    bytes.insert(bytes.end(), data.begin(), data.end());
    for (std::size_t at = 0; at < bytes.size();) {
        const ssize_t written = ::send(fd_, bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL);
        if (written <= 0) {
            do_close();
            return;
        }
        at += static_cast<std::size_t>(written);
    }
}

void UsbIpPort::pump() {
    std::array<std::uint8_t, 16384> chunk{};
    for (;;) {
        const ssize_t bytes = fd_ < 0 ? 0 : ::recv(fd_, chunk.data(), chunk.size(), MSG_DONTWAIT);
        if (bytes == 0) {
            do_close();
            return;
        }
        if (bytes < 0) {
            break;
        }
        input_.insert(input_.end(), chunk.begin(), chunk.begin() + bytes);
    }
    std::size_t at = 0;
    while (fd_ >= 0 && input_.size() - at >= kHeader) {
        const std::uint8_t* head = input_.data() + at;
        Request request{word(head), word(head + 4), word(head + 12) == 1, word(head + 16), word(head + 24), {}};
        std::copy_n(head + 40, request.setup.size(), request.setup.begin());
        const std::size_t data = request.command == kSubmit && !request.to_host ? request.length : 0;
        if (input_.size() - at < kHeader + data) {
            break;
        }
        if (request.command == kUnlink) {
            unlink(request, word(head + 20));
        } else {
            handle(request, std::span(input_).subspan(at + kHeader, data));
        }
        at += kHeader + data;
    }
    input_.erase(input_.begin(), input_.begin() + static_cast<std::ptrdiff_t>(std::min(at, input_.size())));
    deliver();
}

void UsbIpPort::unlink(const Request& request, std::uint32_t victim) {
    const auto found = std::find_if(pending_.begin(), pending_.end(), [&](const Pending& p) { return p.number == victim; });
    const auto held = std::find_if(withheld_.begin(), withheld_.end(), [&](const Request& r) { return r.number == victim; });
    const bool was_there = found != pending_.end() || held != withheld_.end();
    if (found != pending_.end()) {
        pending_.erase(found);
    } else if (held != withheld_.end()) {
        withheld_.erase(held);
    }
    answer(kUnlinked, request.number, was_there ? -ECONNRESET : 0, {}, 0);
}

void UsbIpPort::handle(const Request& request, std::span<const std::uint8_t> data) {
    if (request.endpoint == 0) {
        control(request);
    } else if (request.to_host) {
        pending_.push_back({request.number, request.length});
    } else if (hung_) {
        withheld_.push_back(request);
    } else {
        for (const std::uint8_t byte : data) {
            if (reader_.push(byte)) {
                arrived(reader_.message());
            }
        }
        answer(kSubmitted, request.number, 0, {}, request.length);
    }
}

void UsbIpPort::control(const Request& request) {
    const auto& s = request.setup;
    const std::size_t wanted = s[6] | s[7] << 8U;
    const bool is_standard = (s[0] & 0x60U) == 0;
    if (s[0] == 0x80 && s[1] == 6) {  // get descriptor
        auto bytes = descriptor(params_, s[3], s[2]);
        bytes.resize(std::min(bytes.size(), wanted));
        answer(kSubmitted, request.number, bytes.empty() ? -EPIPE : 0, bytes, bytes.size());
    } else if (is_standard && (s[0] & 0x80U) != 0 && s[1] == 0) {  // get status
        answer(kSubmitted, request.number, 0, std::array<std::uint8_t, 2>{}, 2);
    } else if (is_standard && (s[1] == 1 || s[1] == 3 || s[1] == 9 || s[1] == 11)) {  // features, configuration, interface
        answer(kSubmitted, request.number, 0, {}, 0);
    } else {
        answer(kSubmitted, request.number, -EPIPE, {}, 0);
    }
}

void UsbIpPort::deliver() {
    while (fd_ >= 0 && !pending_.empty() && !hung_ && (stalls_ > 0 || !packets_.empty())) {
        const Pending request = pending_.front();
        pending_.pop_front();
        if (stalls_ > 0) {
            --stalls_;
            answer(kSubmitted, request.number, -EPIPE, {}, 0);
            continue;
        }
        auto packet = std::move(packets_.front());
        packets_.pop_front();
        packet.resize(std::min<std::size_t>(packet.size(), request.length));
        answer(kSubmitted, request.number, 0, packet, packet.size());
    }
}

void UsbIpPort::send_packet(std::vector<std::uint8_t> bytes) {
    packets_.push_back(std::move(bytes));
    deliver();
}

Status UsbIpPort::do_send(std::span<const std::uint8_t> message) {
    if (fd_ < 0) {
        return {StatusCode::device_lost, "not plugged in"};
    }
    if (packets_.size() >= kMostPackets) {
        ++counts().send_queue_full;
        return {StatusCode::not_ready, "the host does not read"};
    }
    std::vector<std::uint8_t> bytes(protocol::framed_bytes(message.size()));
    bytes.resize(protocol::frame(message, bytes));
    for (std::size_t at = 0; at < bytes.size(); at += kPacket) {
        const auto end = bytes.begin() + static_cast<std::ptrdiff_t>(std::min(at + kPacket, bytes.size()));
        packets_.emplace_back(bytes.begin() + static_cast<std::ptrdiff_t>(at), end);
    }
    ++counts().sent;
    deliver();
    return {};
}

Status UsbIpPort::do_receive(hal::ReceivedMessage& message) {
    if (fd_ < 0) {
        return {StatusCode::device_lost, "not plugged in"};
    }
    pump();
    return take_arrived(message);
}

Status UsbIpPort::do_wait(Microseconds timeout) {
    if (fd_ < 0) {
        return {StatusCode::device_lost, "not plugged in"};
    }
    pollfd poll{fd_, POLLIN, 0};
    const std::int64_t us = std::max<std::int64_t>(timeout.count(), 0);
    const timespec limit{us / 1'000'000, us % 1'000'000 * 1000};
    return ::ppoll(&poll, 1, &limit, nullptr) > 0 ? Status{} : Status{StatusCode::timed_out, "nothing came"};
}

}  // namespace tricoil::sim

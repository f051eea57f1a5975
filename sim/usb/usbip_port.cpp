#include "sim/usb/usbip_port.hpp"

#include <poll.h>

#include <algorithm>
#include <cerrno>

namespace tricoil::sim {
namespace {

constexpr std::size_t kPacket = 512;
constexpr std::size_t kMaxPackets = 1024;

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
    reason() = wire_.plug_in(UsbSpeed::high);
    return wire_.is_plugged_in() ? Status{} : Status{StatusCode::device_lost, "no virtual host controller"};
}

void UsbIpPort::do_close() {
    wire_.unplug();
    pending_.clear();
    packets_.clear();
    forget_arrived();
    withheld_.clear();
    reader_.reset();
}

bool UsbIpPort::unlink(std::uint32_t victim) {
    return std::erase_if(pending_, [&](const Pending& p) { return p.number == victim; }) + std::erase(withheld_, victim) > 0;
}

void UsbIpPort::handle(const UsbIpRequest& request, std::span<const std::uint8_t> data) {
    if (request.endpoint == 0) {
        control(request);
    } else if (request.to_host) {
        pending_.push_back({request.number, request.length});
    } else if (hung_) {
        withheld_.push_back(request.number);
    } else {
        for (const std::uint8_t byte : data) {
            if (reader_.push(byte)) {
                arrived(reader_.message());
            }
        }
        wire_.answer(request.number, 0, {}, request.length);
    }
}

void UsbIpPort::control(const UsbIpRequest& request) {
    const auto& s = request.setup;
    const std::size_t wanted = s[6] | s[7] << 8U;
    const bool is_standard = (s[0] & 0x60U) == 0;
    if (s[0] == 0x80 && s[1] == 6) {  // get descriptor
        auto bytes = descriptor(params_, s[3], s[2]);
        bytes.resize(std::min(bytes.size(), wanted));
        wire_.answer(request.number, bytes.empty() ? -EPIPE : 0, bytes, bytes.size());
    } else if (is_standard && (s[0] & 0x80U) != 0 && s[1] == 0) {  // get status
        wire_.answer(request.number, 0, std::array<std::uint8_t, 2>{}, 2);
    } else if (is_standard && (s[1] == 1 || s[1] == 3 || s[1] == 9 || s[1] == 11)) {  // features, configuration, interface
        wire_.answer(request.number, 0, {}, 0);
    } else {
        wire_.answer(request.number, -EPIPE, {}, 0);
    }
}

void UsbIpPort::deliver() {
    while (wire_.is_plugged_in() && !pending_.empty() && !hung_ && (stalls_ > 0 || !packets_.empty())) {
        const Pending request = pending_.front();
        pending_.pop_front();
        if (stalls_ > 0) {
            --stalls_;
            wire_.answer(request.number, -EPIPE, {}, 0);
            continue;
        }
        auto packet = std::move(packets_.front());
        packets_.pop_front();
        packet.resize(std::min<std::size_t>(packet.size(), request.length));
        wire_.answer(request.number, 0, packet, packet.size());
    }
}

void UsbIpPort::send_packet(std::vector<std::uint8_t> bytes) {
    packets_.push_back(std::move(bytes));
    deliver();
}

Status UsbIpPort::do_send(std::span<const std::uint8_t> message) {
    if (!wire_.is_plugged_in()) {
        return {StatusCode::device_lost, "not plugged in"};
    }
    if (packets_.size() >= kMaxPackets) {
        ++counts().send_queue_full;
        return {StatusCode::not_ready, "the host does not read"};
    }
    std::vector<std::uint8_t> bytes(protocol::framed_bytes(message.size()));
    bytes.resize(protocol::frame(message, bytes));
    for (std::size_t at = 0; at < bytes.size(); at += kPacket) {
        const auto end = bytes.begin() + static_cast<std::ptrdiff_t>(std::min(at + kPacket, bytes.size()));
        packets_.emplace_back(bytes.begin() + static_cast<std::ptrdiff_t>(at), end);
    }
    deliver();
    return {};
}

Status UsbIpPort::do_receive(hal::ReceivedMessage& message) {
    wire_.serve();
    if (!wire_.is_plugged_in()) {
        return {StatusCode::device_lost, "not plugged in"};
    }
    deliver();
    return take_arrived(message);
}

Status UsbIpPort::do_wait(Microseconds timeout) {
    if (!wire_.is_plugged_in()) {
        return {StatusCode::device_lost, "not plugged in"};
    }
    pollfd poll{wire_.fd(), POLLIN, 0};
    const std::int64_t us = std::max<std::int64_t>(timeout.count(), 0);
    const timespec limit{us / 1'000'000, us % 1'000'000 * 1000};
    return ::ppoll(&poll, 1, &limit, nullptr) > 0 ? Status{} : Status{StatusCode::timed_out, "no message"};
}

}  // namespace tricoil::sim

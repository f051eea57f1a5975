// Messages on CAN FD: one per frame, with type and node in the identifier, padded with zeros to the next CAN FD length. Longer
// messages are segmented (iso_tp.hpp) and use other identifiers.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/protocol/schema.hpp"
#include "core/protocol/wire_error.hpp"

namespace tricoil::protocol {

/// Standard (11-bit) identifier: 0x100 | type << 4 | node. Types are in order of priority; 14 and 15 are segments.
constexpr std::uint32_t kCanBase = 0x100;
constexpr std::uint8_t kSegmentsFromDevice = 14;
constexpr std::uint8_t kSegmentsFromHost = 15;

struct CanFrame {
    std::uint32_t id = 0;
    std::uint8_t length = 0;  // bytes, a valid CAN FD length
    std::array<std::uint8_t, kMaxFrameBytes> data{};
    [[nodiscard]] std::span<const std::uint8_t> bytes() const {
        return {data.data(), length < data.size() ? length : data.size()};
    }
};

constexpr std::uint32_t can_id(std::uint8_t channel, std::uint8_t node) {
    return kCanBase | static_cast<std::uint32_t>(channel << 4U) | (node & 0x0FU);
}
constexpr std::uint32_t can_id(MessageType type, std::uint8_t node) { return can_id(static_cast<std::uint8_t>(type), node); }
constexpr std::uint8_t channel_of(std::uint32_t id) { return static_cast<std::uint8_t>((id >> 4U) & 0x0FU); }

/// Smallest CAN FD frame length for `bytes` (at most 64).
constexpr std::uint8_t can_fd_length(std::size_t bytes) {
    constexpr std::array<std::uint8_t, 7> kLengths{12, 16, 20, 24, 32, 48, 64};
    if (bytes <= 8) {
        return static_cast<std::uint8_t>(bytes);
    }
    for (const std::uint8_t length : kLengths) {
        if (bytes <= length) {
            return length;
        }
    }
    return 64;
}

/// False if the message is shorter than its prefix or longer than a frame.
inline bool to_frame(std::span<const std::uint8_t> message, std::uint8_t node, CanFrame& frame) {
    if (message.size() < kPrefixBytes || message.size() > kMaxFrameBytes) {
        return false;
    }
    frame = CanFrame{};
    frame.id = can_id(message[1], node);
    frame.length = can_fd_length(message.size());
    for (std::size_t i = 0; i < message.size(); ++i) {
        frame.data[i] = message[i];
    }
    return true;
}

/// The message in a frame of a message channel, without padding. wrong_sender: identifier and content have different types.
/// wrong_length: too short, too long, or padding is not zero. Other errors: those of the prefix.
inline WireError from_frame(const CanFrame& frame, std::span<const std::uint8_t>& message) {
    const std::span<const std::uint8_t> bytes = frame.bytes();
    if (bytes.size() < kPrefixBytes) {
        return WireError::too_short;
    }
    if (bytes[0] < kOldestVersion || bytes[0] > kNewestVersion) {
        return WireError::unknown_version;
    }
    const MessageSize size = size_of_type(bytes[1]);
    if (size.fixed == 0) {
        return WireError::unknown_type;
    }
    if (channel_of(frame.id) != bytes[1]) {
        return WireError::wrong_sender;
    }
    if (size.fixed > kMaxFrameBytes || bytes.size() != can_fd_length(size.fixed)) {
        return WireError::wrong_length;
    }
    for (std::size_t i = size.fixed; i < bytes.size(); ++i) {
        if (bytes[i] != 0) {
            return WireError::wrong_length;
        }
    }
    message = bytes.first(size.fixed);
    return WireError::none;
}

}  // namespace tricoil::protocol

// Messages to bytes and back, driven by the schema. Same bytes on every link; no allocation; any bytes may be given to decode().
#pragma once

#include <span>

#include "core/protocol/schema.hpp"
#include "core/protocol/wire_error.hpp"

namespace tricoil::protocol {

/// Bytes that encode() will write.
template <typename Message>
std::size_t encoded_bytes(const Message& message) {
    if constexpr (Schema<Message>::kInfo.tail_unit > 0) {
        return kFixedBytes<Message> + message.tail.size();
    } else {
        return kFixedBytes<Message>;
    }
}

namespace detail {

template <typename Message, typename F>
void put_field(const Message& message, const F& f, std::uint8_t*& at) {
    const auto put_one = [&](auto value) {
        put(at, f.info.type, value);
        at += size_of(f.info.type);
    };
    if constexpr (std::tuple_size_v<decltype(f.names)> == 1) {
        put_one(message.*f.member);
    } else {
        for (const auto value : message.*f.member) {
            put_one(value);
        }
    }
}

/// False if a number is outside the field's range; NaN is outside of any.
template <typename Message, typename F>
bool get_field(Message& message, const F& f, const std::uint8_t*& at) {
    bool possible = true;
    const auto get_one = [&](auto& value) {
        value = get<std::remove_reference_t<decltype(value)>>(at, f.info.type);
        at += size_of(f.info.type);
        const auto number = static_cast<double>(value);
        possible = possible && number >= f.info.low && number <= f.info.high;
    };
    if constexpr (std::tuple_size_v<decltype(f.names)> == 1) {
        get_one(message.*f.member);
    } else {
        for (auto& value : message.*f.member) {
            get_one(value);
        }
    }
    return possible;
}

}  // namespace detail

/// Writes the message; returns its bytes, or 0 if `out` is too small, the message is longer than kMaxMessageBytes, or its tail is
/// no whole number of elements.
template <typename Message>
std::size_t encode(const Message& message, std::span<std::uint8_t> out) {
    using S = Schema<Message>;
    const std::size_t bytes = encoded_bytes(message);
    if (bytes > out.size() || bytes > kMaxMessageBytes) {
        return 0;
    }
    std::uint8_t* at = out.data();
    *at++ = kNewestVersion;
    *at++ = static_cast<std::uint8_t>(S::kInfo.type);
    std::apply([&](const auto&... f) { (detail::put_field(message, f, at), ...); }, kStampFields);
    std::apply([&](const auto&... f) { (detail::put_field(message, f, at), ...); }, S::kFields);
    if constexpr (S::kInfo.tail_unit > 0) {
        if (message.tail.size() % S::kInfo.tail_unit != 0) {
            return 0;
        }
        for (const std::uint8_t byte : message.tail) {
            *at++ = byte;
        }
    }
    return bytes;
}

/// The type of a message, once version, type and length are known to be right; else the reason in `error`.
inline MessageType type_of(std::span<const std::uint8_t> bytes, WireError& error) {
    error = WireError::none;
    if (bytes.size() < kPrefixBytes) {
        error = WireError::too_short;
        return {};
    }
    if (bytes[0] < kOldestVersion || bytes[0] > kNewestVersion) {
        error = WireError::unknown_version;
        return {};
    }
    const MessageSize size = size_of_type(bytes[1]);
    if (size.fixed == 0) {
        error = WireError::unknown_type;
        return {};
    }
    const std::size_t tail = bytes.size() - std::min(bytes.size(), size.fixed);
    if (bytes.size() > kMaxMessageBytes) {
        error = WireError::oversize;
    } else if (bytes.size() < size.fixed || (size.tail_unit == 0 ? tail != 0 : tail % size.tail_unit != 0)) {
        error = WireError::wrong_length;
    }
    return static_cast<MessageType>(bytes[1]);
}

/// Reads a message of the type asked for (unknown_type if it is another). A tail stays where it is: `message.tail` points into
/// `bytes`. After an error `message` must not be used.
template <typename Message>
[[nodiscard]] WireError decode(std::span<const std::uint8_t> bytes, Message& message) {
    using S = Schema<Message>;
    WireError error = WireError::none;
    const MessageType type = type_of(bytes, error);
    if (error != WireError::none) {
        return error;
    }
    if (type != S::kInfo.type) {
        return WireError::unknown_type;
    }
    const std::uint8_t* at = bytes.data() + kPrefixBytes;
    bool possible = true;
    const auto read = [&](const auto&... f) { ((possible = detail::get_field(message, f, at) && possible), ...); };
    std::apply(read, kStampFields);
    std::apply(read, S::kFields);
    if constexpr (S::kInfo.tail_unit > 0) {
        message.tail = bytes.subspan(kFixedBytes<Message>);
    }
    return possible ? WireError::none : WireError::impossible;
}

}  // namespace tricoil::protocol

// Encoding and decoding of messages, driven by the schema. The bytes are the same on every link. No allocation. decode() accepts
// any bytes.
#pragma once

#include <span>
#include <utility>

#include "core/protocol/schema.hpp"
#include "core/protocol/wire_error.hpp"

namespace tricoil::protocol {

/// Number of bytes that encode() writes.
template <typename Message>
std::size_t encoded_bytes(const Message& message) {
    if constexpr (Schema<Message>::kInfo.tail_unit > 0) {
        return kFixedBytes<Message> + message.tail.size();
    } else {
        return kFixedBytes<Message>;
    }
}

namespace detail {

// A field is identified by its index in a schema, so it is known at compile time and no table is stored in flash. It is used by
// reference, not copied: with a copied pointer to a member of the stamp, GCC 12 at -O2 confuses it with another member and loses
// values.

template <const auto& fields, std::size_t place, typename Message>
void put_field(const Message& message, std::uint8_t*& at) {
    constexpr const auto& kField = std::get<place>(fields);
    const auto put_one = [&](auto value) {
        put(at, kField.info.type, value);
        at += size_of(kField.info.type);
    };
    if constexpr (kField.names.size() == 1) {
        put_one(message.*kField.member);
    } else {
        for (const auto value : message.*kField.member) {
            put_one(value);
        }
    }
}

/// True if a number from the wire is in the range of the field. False for NaN.
template <WireType type, typename Value>
bool is_within(Value value, double low, double high) {
    if constexpr (type == WireType::f32) {
        return value >= static_cast<float>(low) && value <= static_cast<float>(high);
    } else if (low <= lowest(type) && high >= highest(type)) {
        return true;
    } else {
        return static_cast<std::int64_t>(value) >= static_cast<std::int64_t>(low) &&
               static_cast<std::int64_t>(value) <= static_cast<std::int64_t>(high);
    }
}

template <const auto& fields, std::size_t place, typename Message>
bool get_field(Message& message, const std::uint8_t*& at) {
    constexpr const auto& kField = std::get<place>(fields);
    bool possible = true;
    const auto get_one = [&](auto& value) {
        value = get<std::remove_reference_t<decltype(value)>>(at, kField.info.type);
        at += size_of(kField.info.type);
        possible = is_within<kField.info.type>(value, kField.info.low, kField.info.high) && possible;
    };
    if constexpr (kField.names.size() == 1) {
        get_one(message.*kField.member);
    } else {
        for (auto& value : message.*kField.member) {
            get_one(value);
        }
    }
    return possible;
}

template <const auto& fields>
using Places = std::make_index_sequence<std::tuple_size_v<std::remove_cvref_t<decltype(fields)>>>;

template <const auto& fields, typename Message, std::size_t... places>
void put_fields(const Message& message, std::uint8_t*& at, std::index_sequence<places...>) {
    (put_field<fields, places>(message, at), ...);
}

template <const auto& fields, typename Message, std::size_t... places>
bool get_fields(Message& message, const std::uint8_t*& at, std::index_sequence<places...>) {
    bool possible = true;
    ((possible = get_field<fields, places>(message, at) && possible), ...);
    return possible;
}

}  // namespace detail

/// Writes the message and returns the number of bytes. Returns 0 if `out` is too small, the message is longer than
/// kMaxMessageBytes, or its tail is not a whole number of elements.
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
    detail::put_fields<kStampFields>(message, at, detail::Places<kStampFields>{});
    detail::put_fields<S::kFields>(message, at, detail::Places<S::kFields>{});
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

/// Type of a message after a check of version, type and length. If the check fails, the reason is in `error`.
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

/// Decodes a message of the requested type (unknown_type if it has another). `message.tail` points into `bytes`. After an error
/// `message` must not be used.
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
    const bool is_stamped = detail::get_fields<kStampFields>(message, at, detail::Places<kStampFields>{});
    const bool possible = detail::get_fields<S::kFields>(message, at, detail::Places<S::kFields>{}) && is_stamped;
    if constexpr (S::kInfo.tail_unit > 0) {
        message.tail = bytes.subspan(kFixedBytes<Message>);
    }
    return possible ? WireError::none : WireError::impossible;
}

}  // namespace tricoil::protocol

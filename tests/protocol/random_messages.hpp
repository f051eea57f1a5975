// Messages with random numbers within the ranges of their fields.
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "core/protocol/codec.hpp"

namespace tricoil::test {

template <typename T>
T random_number(const protocol::FieldInfo& info, std::mt19937_64& random) {
    if constexpr (std::is_floating_point_v<T>) {
        const double exponent = std::uniform_real_distribution<>(-9, 6)(random);
        const double value = std::copysign(std::pow(10.0, exponent), info.low < 0 && random() % 2 == 0 ? -1.0 : 1.0);
        return static_cast<T>(std::min(std::max(value, info.low), info.high));
    } else {
        const int pick = static_cast<int>(random() % 8);
        const double share = std::uniform_real_distribution<>(0, 1)(random);
        const double value = pick == 0 ? info.low : pick == 1 ? info.high : std::round(info.low + share * (info.high - info.low));
        return value >= 18446744073709551615.0     ? static_cast<T>(~std::uint64_t{0})
               : value >= 9.2e18 && value < 9.3e18 ? static_cast<T>(9'200'000'000'000'000'000)
                                                   : static_cast<T>(value);
    }
}

/// Fills every field; a variable-length tail stays empty.
template <typename Message>
Message random_message(std::mt19937_64& random) {
    Message message;
    const auto fill = [&](const auto& f) {
        auto& member = message.*f.member;
        if constexpr (std::tuple_size_v<decltype(f.names)> == 1) {
            member = random_number<std::remove_reference_t<decltype(member)>>(f.info, random);
        } else {
            for (auto& element : member) {
                element = random_number<std::remove_reference_t<decltype(element)>>(f.info, random);
            }
        }
    };
    std::apply([&](const auto&... f) { (fill(f), ...); }, protocol::kStampFields);
    std::apply([&](const auto&... f) { (fill(f), ...); }, protocol::Schema<Message>::kFields);
    return message;
}

template <typename Message>
std::vector<std::uint8_t> bytes_of(const Message& message) {
    std::vector<std::uint8_t> bytes(protocol::kMaxMessageBytes);
    bytes.resize(protocol::encode(message, bytes));
    return bytes;
}

inline std::vector<std::uint8_t> random_bytes(std::size_t count, std::mt19937_64& random) {
    std::vector<std::uint8_t> bytes(count);
    for (auto& byte : bytes) {
        byte = static_cast<std::uint8_t>(random());
    }
    return bytes;
}

}  // namespace tricoil::test

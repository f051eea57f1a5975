// Encoding of one number in a message: little-endian, two's complement, 1 to 8 bytes; or an IEEE 754 binary32.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace tricoil::protocol {

enum class WireType : std::uint8_t { u8, u16, u32, u64, i16, i24, i32, i64, u24, f32 };

constexpr std::size_t size_of(WireType type) {
    switch (type) {
        case WireType::u8:
            return 1;
        case WireType::u16:
        case WireType::i16:
            return 2;
        case WireType::u24:
        case WireType::i24:
            return 3;
        case WireType::u32:
        case WireType::i32:
        case WireType::f32:
            return 4;
        case WireType::u64:
        case WireType::i64:
            return 8;
    }
    return 0;
}

constexpr bool is_signed(WireType type) {
    return type == WireType::i16 || type == WireType::i24 || type == WireType::i32 || type == WireType::i64;
}

/// Smallest and largest number of the type; for floating point the largest finite ones.
constexpr double lowest(WireType type) {
    if (type == WireType::f32) {
        return -3.4028234663852886e38;
    }
    return is_signed(type) ? -static_cast<double>(std::uint64_t{1} << (8 * size_of(type) - 1)) : 0.0;
}
constexpr double highest(WireType type) {
    if (type == WireType::f32) {
        return 3.4028234663852886e38;
    }
    const std::size_t bits = 8 * size_of(type) - (is_signed(type) ? 1 : 0);
    return bits == 64 ? 18446744073709551615.0 : static_cast<double>((std::uint64_t{1} << bits) - 1);
}

/// Writes the low `bytes` bytes of `value`, least significant first.
constexpr void put_bytes(std::uint8_t* to, std::uint64_t value, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; ++i) {
        to[i] = static_cast<std::uint8_t>(value >> (8 * i));
    }
}

constexpr std::uint64_t get_bytes(const std::uint8_t* from, std::size_t bytes) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) {
        value |= std::uint64_t{from[i]} << (8 * i);
    }
    return value;
}

/// Two's complement number of `bytes` bytes, extended to 64 bits.
constexpr std::int64_t sign_extended(std::uint64_t value, std::size_t bytes) {
    const std::uint64_t sign = std::uint64_t{1} << (8 * bytes - 1);
    return static_cast<std::int64_t>((value ^ sign) - sign);
}

template <typename T>
constexpr void put(std::uint8_t* to, WireType type, T value) {
    if constexpr (std::is_floating_point_v<T>) {
        put_bytes(to, std::bit_cast<std::uint32_t>(static_cast<float>(value)), size_of(type));
    } else {
        put_bytes(to, static_cast<std::uint64_t>(value), size_of(type));
    }
}

template <typename T>
constexpr T get(const std::uint8_t* from, WireType type) {
    const std::uint64_t bits = get_bytes(from, size_of(type));
    if constexpr (std::is_floating_point_v<T>) {
        return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
    } else {
        return static_cast<T>(is_signed(type) ? sign_extended(bits, size_of(type)) : static_cast<std::int64_t>(bits));
    }
}

}  // namespace tricoil::protocol

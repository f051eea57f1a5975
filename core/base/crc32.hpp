// CRC-32 as in IEEE 802.3 (reflected polynomial 0xEDB88320, start and final xor all ones): the check value of "123456789" is
// 0xCBF43926.
#pragma once

#include <cstdint>
#include <span>

namespace tricoil {

/// Continues a CRC-32: `before` is the CRC-32 of the data before `bytes`.
constexpr std::uint32_t crc32_continued(std::uint32_t before, std::span<const std::uint8_t> bytes) {
    std::uint32_t crc = ~before;
    for (const std::uint8_t byte : bytes) {
        crc ^= byte;
        for (int bit = 0; bit < 8; ++bit) {
            crc = (crc >> 1) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
        }
    }
    return ~crc;
}

/// Bitwise, without a table: inputs are short, and a table costs flash.
constexpr std::uint32_t crc32(std::span<const std::uint8_t> bytes) { return crc32_continued(0, bytes); }

}  // namespace tricoil

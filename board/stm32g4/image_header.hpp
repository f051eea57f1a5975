// Header at a fixed place of an image, for programs that read images (toolchain/image-info).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "board/stm32g4/flash_layout.hpp"
#include "drivers/stm32g4/boot_record.hpp"

namespace tricoil::stm32g4_board {

constexpr std::uint32_t kImageMagic = 0x49435254;  // "TRCI"

/// Little-endian. Since version 3 the image has a selector of the bank before its vectors.
struct ImageHeader {
    std::uint32_t magic = kImageMagic;
    std::uint16_t header_version = 3;
    std::uint8_t oldest_protocol = 0;
    std::uint8_t newest_protocol = 0;
    std::uint32_t firmware = 0;            // major << 16, minor << 8, patch
    const std::byte* image_end = nullptr;  // address after the last byte
    std::array<char, 16> commit{};         // zero-terminated; ends in + if files differ from the commit
    std::array<char, 16> board{};
    std::uint32_t crc = 0;  // CRC-32 of IEEE 802.3 from the vectors on, with zero here; filled in by toolchain/image-seal
    stm32g4::BootRecord* boot_record = nullptr;  // where the selector of the bank reads requests
};
static_assert(offsetof(ImageHeader, commit) != 16 || offsetof(ImageHeader, crc) == 48);  // where pointers have 4 bytes

extern const ImageHeader image_header;

}  // namespace tricoil::stm32g4_board

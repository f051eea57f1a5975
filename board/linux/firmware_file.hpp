// Image of a tracker board for an update over a link.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace tricoil::linux_board {

struct Firmware {
    std::vector<std::uint8_t> program;  // from the vectors on; the board keeps what is before them
    std::uint32_t crc = 0;              // CRC-32 of `program`, with zero in the place of the CRC
};

/// Throws InputError, which begins with `name`, if the bytes are not a complete image with a header of this version
/// (board/stm32g4/image_header.hpp).
[[nodiscard]] Firmware parse_firmware(const std::string& name, std::span<const std::uint8_t> file);

}  // namespace tricoil::linux_board

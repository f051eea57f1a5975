// Check of an image against the CRC in its header.
#pragma once

#include <cstdint>

namespace tricoil::stm32g4_board {

struct ImageCheck {
    bool is_sound = false;
    std::uint32_t crc = 0;  // CRC-32 from the vectors to the last byte, with zero in place of the header's CRC
};

/// False if a header with this end is damaged, or the image is too long.
[[nodiscard]] bool has_plausible_end(std::uint32_t end);

/// `bank`: address of the image's bank. Takes some milliseconds. Uses the CRC unit, whose clock must be on.
[[nodiscard]] ImageCheck check_image(std::uintptr_t bank);

}  // namespace tricoil::stm32g4_board

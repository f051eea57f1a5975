// Check of the running image against the CRC in its header.
#pragma once

#include <cstdint>

namespace tricoil::stm32g4_board {

struct ImageCheck {
    bool is_sound = false;
    std::uint32_t crc = 0;  // CRC-32 from the first byte to the last, with zero in place of the header's CRC
};

/// Takes some milliseconds. Uses the CRC unit, whose clock must be on.
[[nodiscard]] ImageCheck check_image();

}  // namespace tricoil::stm32g4_board

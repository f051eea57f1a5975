#include "board/stm32g4/image_check.hpp"

#include "board/stm32g4/image_header.hpp"
#include "drivers/stm32g4/crc_unit.hpp"
#include "drivers/stm32g4/registers/peripheral.hpp"

namespace tricoil::stm32g4_board {

using stm32g4::peripheral;

bool has_plausible_end(std::uint32_t end) {
    const std::size_t bytes = end - stm32g4::kFlash - kProgramOffset;
    return bytes >= kImageHeaderOffset - kProgramOffset + sizeof(ImageHeader) && bytes <= kMaxProgramBytes && bytes % 4 == 0;
}

ImageCheck check_image(std::uintptr_t bank) {
    stm32g4::CrcUnit unit(peripheral<stm32g4::CrcRegisters>(stm32g4::kCrcBase));
    const std::uintptr_t header = bank + kImageHeaderOffset;
    // Volatile: the compiler must not use the CRC of the source instead of the one that the build filled in.
    const auto* const filled_in = &peripheral<const volatile std::uint32_t>(header + offsetof(ImageHeader, crc));
    const std::uint32_t end = peripheral<const volatile std::uint32_t>(header + offsetof(ImageHeader, image_end));
    if (!has_plausible_end(end)) {
        return {false, 0};
    }
    const auto* const last = &peripheral<const volatile std::uint32_t>(bank + end - stm32g4::kFlash);
    for (const auto* word = &peripheral<const volatile std::uint32_t>(bank + kProgramOffset); word != last; ++word) {
        unit.add(word == filled_in ? 0 : *word);
    }
    const std::uint32_t crc = unit.value();
    return {crc == *filled_in, crc};
}

}  // namespace tricoil::stm32g4_board

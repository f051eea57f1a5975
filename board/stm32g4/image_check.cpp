#include "board/stm32g4/image_check.hpp"

#include "board/stm32g4/image_header.hpp"
#include "drivers/stm32g4/crc_unit.hpp"
#include "drivers/stm32g4/registers/peripheral.hpp"

namespace tricoil::stm32g4_board {
namespace {

constexpr std::uintptr_t kImage = 0x0800'0000;
constexpr std::uintptr_t kLongestImage = 256 * 1024;  // bank 1

/// False if the header itself is damaged: then the end is not known.
bool has_plausible_end(std::uintptr_t end) {
    const bool is_inside = end >= kImage + kImageHeaderOffset + sizeof(ImageHeader) && end <= kImage + kLongestImage;
    return is_inside && end % sizeof(std::uint32_t) == 0;
}

}  // namespace

ImageCheck check_image() {
    stm32g4::CrcUnit unit(stm32g4::peripheral<stm32g4::CrcRegisters>(stm32g4::kCrcBase));
    // Volatile: the compiler must not use the CRC of the source instead of the one that the build filled in.
    const volatile std::uint32_t* const filled_in = &image_header.crc;
    const std::byte* const volatile* const stored_end = &image_header.image_end;
    const auto* const end = reinterpret_cast<const volatile std::uint32_t*>(*stored_end);
    if (!has_plausible_end(reinterpret_cast<std::uintptr_t>(end))) {
        return {false, 0};
    }
    for (const auto* word = &stm32g4::peripheral<const volatile std::uint32_t>(kImage); word != end; ++word) {
        unit.add(word == filled_in ? 0 : *word);
    }
    const std::uint32_t crc = unit.value();
    return {crc == *filled_in, crc};
}

}  // namespace tricoil::stm32g4_board

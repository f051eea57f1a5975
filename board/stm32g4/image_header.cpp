#include "board/stm32g4/image_header.hpp"

#include "board/stm32g4/startup.hpp"
#include "core/protocol/message_type.hpp"
#include "image_version.hpp"

// NOLINTNEXTLINE(readability-identifier-naming): name of the linker script
extern "C" const std::byte image_end[];

namespace tricoil::stm32g4_board {
namespace {

constexpr std::array<char, 16> text(const char* from) {
    std::array<char, 16> to{};
    for (std::size_t n = 0; n + 1 < to.size() && from[n] != 0; ++n) {
        to[n] = from[n];
    }
    return to;
}

}  // namespace

[[gnu::section(".image_header"), gnu::used]] const ImageHeader image_header{
    .oldest_protocol = protocol::kOldestVersion,
    .newest_protocol = protocol::kNewestVersion,
    .firmware = kFirmwareVersion,
    .image_end = image_end,
    .commit = text(kCommit),
    .board = text(TRICOIL_BOARD_NAME),
    .boot_record = &boot_record,
};

}  // namespace tricoil::stm32g4_board

#include "board/linux/firmware_file.hpp"

#include "board/support/errors.hpp"
#include "core/base/crc32.hpp"
#include "core/protocol/wire_type.hpp"

namespace tricoil::linux_board {
namespace {

// Offsets in the file, and in the header (board/stm32g4/flash_layout.hpp and image_header.hpp).
constexpr std::size_t kProgram = 0x2000;
constexpr std::size_t kHeader = 0x2200;
constexpr std::size_t kVersion = kHeader + 4;
constexpr std::size_t kEnd = kHeader + 12;
constexpr std::size_t kCrc = kHeader + 48;
constexpr std::uint32_t kMagic = 0x49435254;
constexpr std::uint16_t kHeaderVersion = 3;
constexpr std::uint32_t kFlash = 0x0800'0000;

}  // namespace

Firmware parse_firmware(const std::string& name, std::span<const std::uint8_t> file) {
    const auto number = [&](std::size_t at, std::size_t bytes) {
        return static_cast<std::uint32_t>(protocol::get_bytes(file.data() + at, bytes));
    };
    host::refuse_if(file.size() < kCrc + 4 || number(kHeader, 4) != kMagic,
                    "{}: no image of a tracker board; give the .bin of toolchain/build nucleo-g474re", name);
    host::refuse_if(number(kVersion, 2) != kHeaderVersion,
                    "{}: image header of version {}, this program reads version {}; give an image of this release", name,
                    number(kVersion, 2), kHeaderVersion);
    Firmware firmware{{file.begin() + kProgram, file.end()}, number(kCrc, 4)};
    std::fill_n(firmware.program.begin() + (kCrc - kProgram), 4, std::uint8_t{0});
    host::refuse_if(number(kEnd, 4) - kFlash != file.size() || crc32(firmware.program) != firmware.crc,
                    "{}: the image is damaged; build or copy it again", name);
    std::copy_n(file.begin() + kCrc, 4, firmware.program.begin() + (kCrc - kProgram));
    return firmware;
}

}  // namespace tricoil::linux_board

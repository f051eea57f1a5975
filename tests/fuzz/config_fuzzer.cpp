// Random text as the board's TOML file: it is accepted, or refused with an InputError.
#include "board/linux/device_config.hpp"
#include "board/support/errors.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    const std::string text(data, data + size);
    try {
        tricoil::linux_board::parse_device_config("board.toml", text);
    } catch (const tricoil::host::InputError&) {
        return 0;
    }
    return 0;
}

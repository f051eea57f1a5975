// Random text as the board's TOML file and as parameters of a tracker board: it is accepted, or refused with an InputError.
#include <cstdlib>
#include <functional>

#include "board/linux/device_config.hpp"
#include "board/support/errors.hpp"

namespace {

using namespace tricoil;  // NOLINT(google-build-using-namespace): a program of one file

/// Accepted values are possible, and survive a file.
void read_parameters(const std::string& text) {
    const auto values = linux_board::parameters_of("kept.toml", text, protocol::kDefaultParameters, false);
    for (std::size_t n = 0; n < values.size(); ++n) {
        if (!protocol::is_possible(n, values[n])) {
            std::abort();
        }
    }
    if (linux_board::parameters_of("kept.toml", linux_board::parameters_toml(values), {}, true) != values) {
        std::abort();
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    const std::string text(data, data + size);
    const auto parse_config = [](const std::string& toml) { linux_board::parse_device_config("board.toml", toml); };
    for (const auto& parse : {std::function<void(const std::string&)>(parse_config), {read_parameters}}) {
        try {
            parse(text);
        } catch (const host::InputError&) {
            continue;
        }
    }
    return 0;
}

#include "board/virtual_board/symbols_file.hpp"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <vector>

#include "board/support/errors.hpp"

namespace tricoil::virtual_board {

Symbols read_symbols(const std::string& elf_path) {
    std::ifstream stream(elf_path, std::ios::binary);
    const std::vector<char> file{std::istreambuf_iterator<char>(stream), {}};
    try {
        return Symbols(file);
    } catch (const std::invalid_argument& error) {
        throw host::InputError(fmt::format("{}: {}; give the unstripped .elf of the image", elf_path, error.what()));
    }
}

}  // namespace tricoil::virtual_board

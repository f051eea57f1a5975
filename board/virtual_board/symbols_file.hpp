// Reads the symbols of a firmware from its ELF file.
#pragma once

#include <string>

#include "sim/virtual_board/machine/symbols.hpp"

namespace tricoil::virtual_board {

/// Throws host::InputError, naming the file, if it is missing or is not an ELF file for 32-bit Arm with symbols.
Symbols read_symbols(const std::string& elf_path);

}  // namespace tricoil::virtual_board

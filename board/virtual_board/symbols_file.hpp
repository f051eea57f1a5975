// Reads the symbols of a firmware from the ELF file that it was made from.
#pragma once

#include <string>

#include "sim/virtual_board/machine/symbols.hpp"

namespace tricoil::virtual_board {

/// Throws host::InputError, naming the file, if it is missing or is not an ELF file of a 32-bit Arm with symbols.
Symbols read_symbols(const std::string& elf_path);

}  // namespace tricoil::virtual_board

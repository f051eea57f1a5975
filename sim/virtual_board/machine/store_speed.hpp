// Speeds up the emulator's stores to RAM.
#pragma once

namespace tricoil::virtual_board {

/// Call it once before the emulator is used, so that the linker includes the source file.
void use_fast_stores();

}  // namespace tricoil::virtual_board

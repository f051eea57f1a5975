// Makes the emulator's stores to RAM as fast as its loads.
#pragma once

namespace tricoil::virtual_board {

/// To be called once by whoever uses the emulator, so that the linker takes what is in the source file.
void use_fast_stores();

}  // namespace tricoil::virtual_board

// Ends an emulated program.
#pragma once

namespace tricoil::semihosting {

/// Ends the emulation; `status` becomes the emulator's exit status.
[[noreturn]] void exit(int status);

}  // namespace tricoil::semihosting

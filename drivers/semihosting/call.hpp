// Semihosting call (ARM, "Semihosting for AArch32 and AArch64", release 2.0).
#pragma once

#include <cstdint>

namespace tricoil::semihosting {

enum class Operation : std::uint32_t {
    open = 0x01,
    write = 0x05,
    read = 0x06,
    exit_extended = 0x20,
    elapsed = 0x30,
    tick_frequency = 0x31,
};

/// `argument` points to the operation's parameter block, or is null. Returns the operation's result.
std::int32_t call(Operation operation, const void* argument);

/// Ends the emulation; `status` becomes the emulator's exit status.
[[noreturn]] void exit(int status);

}  // namespace tricoil::semihosting

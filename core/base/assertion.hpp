// Check of a precondition. A violation is a programming error: the program ends.
#pragma once

namespace tricoil {

/// Host: prints file, line and condition to standard error, then aborts. Image: each board has its own definition. A tracker
/// board stores a fault record, switches the coils off and restarts the processor; an emulated board ends the emulation.
[[noreturn]] void assertion_failed(const char* condition, const char* file, int line);

}  // namespace tricoil

#define TRICOIL_ASSERT(condition) \
    (static_cast<bool>(condition) ? void() : ::tricoil::assertion_failed(#condition, __FILE__, __LINE__))

// Check of a precondition. A violation is a programming error: the program ends.
#pragma once

namespace tricoil {

/// Host: prints file, line and condition to standard error, then aborts. Image: each board has its own definition. A tracker
/// board stores a fault record, switches the coils off and restarts the processor; an emulated board ends the emulation.
[[noreturn]] void assertion_failed(const char* condition, const char* file, int line);
/// The same, without a message. A tracker board stores the return address of this call in its fault record.
[[noreturn]] void assertion_failed();

}  // namespace tricoil

/// 1: failed assertions and Status have messages. 0 saves flash and stack on boards that cannot show messages (CMake:
/// TRICOIL_STATUS_MESSAGES). All code of an image must use the same value.
#ifndef TRICOIL_STATUS_MESSAGES
#define TRICOIL_STATUS_MESSAGES 1
#endif

#if TRICOIL_STATUS_MESSAGES
#define TRICOIL_ASSERT(condition) \
    (static_cast<bool>(condition) ? void() : ::tricoil::assertion_failed(#condition, __FILE__, __LINE__))
#else
#define TRICOIL_ASSERT(condition) (static_cast<bool>(condition) ? void() : ::tricoil::assertion_failed())
#endif

// Start-up from a valid stack pointer to main, for boards without C runtime start-up files.
#pragma once

namespace tricoil::board {

/// Paints the stack, copies initialised data, clears .bss, constructs static objects. Call once, from the reset handler.
void initialise_memory();

// Each board defines these two functions.
/// Stops after an unrecoverable error.
[[noreturn]] void halt();
/// Called after main.
[[noreturn]] void finish(int status);

/// Calls main; never inlined into the start-up code.
int run_main();

}  // namespace tricoil::board

// From a stack pointer to main, for boards that link no C runtime start-up files.
#pragma once

namespace tricoil::board {

/// Paints the stack, copies initialised data, clears the rest, makes the statics. From the reset handler, once.
void initialise_memory();

// Each board defines these two.
/// Instead of going on when something is badly wrong.
[[noreturn]] void halt();
/// After main.
[[noreturn]] void finish(int status);

/// What runs after reset; never inlined into what comes before it.
int run_main();

}  // namespace tricoil::board

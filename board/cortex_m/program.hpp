// From a stack pointer to main, for boards that link no C runtime start-up files.
#pragma once

namespace tricoil::board {

/// Paints the stack, copies initialised data, clears the rest, makes the statics. From the reset handler, once.
void initialise_memory();

/// What the board does instead of going on when something is badly wrong. Each board defines it.
[[noreturn]] void halt();

/// What runs after reset; never inlined into what comes before it.
int run_main();

}  // namespace tricoil::board

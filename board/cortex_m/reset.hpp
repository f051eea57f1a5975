// Reset handler.
#pragma once

extern "C" {
/// Entry of the vector table. Order: floating-point unit, before_memory(), data, static objects, main, finish().
[[noreturn]] void reset_handler();

/// Optional hook of a board, called before memory is initialised. It may use only data that survives a reset, and no static
/// objects.
void before_memory();
}

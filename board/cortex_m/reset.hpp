// The first instructions after reset.
#pragma once

extern "C" {
/// For the vectors. Floating-point unit, before_memory(), data, statics, main, finish().
[[noreturn]] void reset_handler();

/// A board may define it: runs before anything is initialised, so that it has no data but what survived the reset, and no
/// statics.
void before_memory();
}

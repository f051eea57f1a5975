// How much of the stack was ever used: it is painted at reset and read afterwards.
#pragma once

#include <cstddef>

namespace tricoil::board {

/// Fills the stack below the caller's frame. Once, at reset, before anything of value lies there.
void paint_stack();

/// Bytes from the top of the stack down to the lowest word that was ever overwritten; the whole stack if it was full. Takes as
/// long as there is paint to look at.
[[nodiscard]] std::size_t used_stack_bytes();

/// Whether next to nothing of it was left: then what lies below may have been overwritten too. Takes a moment only.
[[nodiscard]] bool stack_was_full();

}  // namespace tricoil::board

// Stack high-water mark: the stack is painted at reset and inspected later.
#pragma once

#include <cstddef>

namespace tricoil::board {

/// Paints the stack below the caller's frame. Call it once at reset, while the stack below contains no data.
void paint_stack();

/// Bytes from the top of the stack down to the lowest word ever overwritten; the whole stack if it was full. The run time grows
/// with the unused stack.
[[nodiscard]] std::size_t used_stack_bytes();

/// True if almost no stack was left: then memory below it may be overwritten too. Short run time.
[[nodiscard]] bool stack_was_full();

}  // namespace tricoil::board

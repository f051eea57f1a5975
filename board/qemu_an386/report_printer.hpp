// Self-check report as text, without heap and printf.
#pragma once

#include "core/selfcheck/report.hpp"
#include "hal/console.hpp"

namespace tricoil::board {

/// One line per check: id, text, precision, measured, limit, outcome; then the result. Errors: those of Console::write.
Status print(const selfcheck::Report& report, hal::Console& console);

/// Prints "stack N bytes". Errors: those of Console::write; degenerate if the stack was full, so that such an image fails.
Status print_stack_use(hal::Console& console);

}  // namespace tricoil::board

// A self-check's report as text, without a heap and without printf.
#pragma once

#include "core/selfcheck/report.hpp"
#include "hal/console.hpp"

namespace tricoil::board {

/// One line per check: id, what, precision, measured, limit, outcome; then the verdict. Errors: those of Console::write.
Status print(const selfcheck::Report& report, hal::Console& console);

/// "stack N bytes". Errors: those of Console::write; degenerate if the stack was full, so that an image whose stack was too small
/// ends as failed.
Status print_stack_use(hal::Console& console);

}  // namespace tricoil::board

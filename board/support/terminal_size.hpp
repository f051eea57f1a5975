// Width of a terminal.
#pragma once

#include <cstddef>
#include <cstdio>

namespace tricoil::host {

/// Columns of the terminal behind `file`; 80 if `file` is not a terminal or its width is unknown.
std::size_t terminal_width(std::FILE* file);

}  // namespace tricoil::host

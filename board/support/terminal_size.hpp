// Width of a terminal.
#pragma once

#include <cstddef>
#include <cstdio>

namespace tricoil::host {

/// Columns of the terminal behind `file`; 80 if it is none or does not say.
std::size_t terminal_width(std::FILE* file);

}  // namespace tricoil::host

// Colours of text on a terminal.
#pragma once

#include <cstdio>
#include <string>
#include <string_view>

namespace tricoil::host {

enum class Colour : unsigned char { bold, dim, red, green, yellow };

/// True if `file` is a terminal with colours and the user has not set NO_COLOR.
bool has_colours(std::FILE* file);

std::string painted(std::string_view text, Colour colour);

/// Colours lines by their meaning: headings, remarks, warnings, and the words pass and FAIL.
std::string coloured_by_meaning(std::string_view text);

}  // namespace tricoil::host

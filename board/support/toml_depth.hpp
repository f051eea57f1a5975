// A limit to the depth of dotted TOML keys: toml++ limits that of values only, and recurses once a part.
#pragma once

#include <cstddef>
#include <string_view>

namespace tricoil::host {

constexpr std::size_t kDeepestKey = 16;  // parts of one dotted key

/// The line (from 1) of the first chain of more than kDeepestKey parts, as a.b.c has three; 0 if there is none.
std::size_t line_of_deep_key(std::string_view toml);

}  // namespace tricoil::host

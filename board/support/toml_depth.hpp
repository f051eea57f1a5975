// Limits the depth of dotted TOML keys. toml++ limits only the depth of values and recurses for every part of a key.
#pragma once

#include <cstddef>
#include <string_view>

namespace tricoil::host {

constexpr std::size_t kDeepestKey = 16;  // parts of one dotted key

/// Line (from 1) of the first key with more than kDeepestKey parts (a.b.c has three); 0 if there is none.
std::size_t line_of_deep_key(std::string_view toml);

}  // namespace tricoil::host

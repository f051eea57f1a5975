// Looks up a typed name and suggests the nearest valid one.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tricoil::host {

/// The only choice that begins with `typed`; otherwise the nearest by edit distance, empty if none is near enough or several are
/// equally near.
std::string nearest_name(std::string_view typed, const std::vector<std::string>& choices);

/// Index of `typed` in `choices`. Throws InputError: "unknown WHAT 'typed'; did you mean '...'? choices: ...".
std::size_t index_of_name(std::string_view what, std::string_view typed, const std::vector<std::string>& choices);

}  // namespace tricoil::host

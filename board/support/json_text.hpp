// Text from JSON: the text output of a command is made from its JSON output.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace tricoil::host {

using Json = nlohmann::ordered_json;

/// Returns `text` with each `{KEY}`, `{KEY:FORMAT}` and `{KEY in UNIT:FORMAT}` replaced by a value of `values`. KEY may be a
/// path: `latency_us/max`, `singular_values/0`. FORMAT as in fmt. UNIT converts from the SI unit, or a ratio to %. An object of
/// counts is replaced by their sum. Throws a std::exception for an unknown key or unit, and for a FORMAT that does not suit.
std::string fill(const Json& values, std::string_view text);

/// Prints a command's result as JSON, or as the text that `text_of` makes of it.
void print_result(const Json& result, bool as_json, std::string (*text_of)(const Json& result));

}  // namespace tricoil::host

#include "board/support/toml_depth.hpp"

#include <algorithm>

namespace tricoil::host {
namespace {

/// Position after the string that begins at `at`; for an unterminated string, the position at which a parser stops.
std::size_t end_of_string(std::string_view text, std::size_t at) {
    const char quote = text[at];
    const std::string_view triple = text.substr(at, 3);
    const bool is_long = triple.size() == 3 && triple[1] == quote && triple[2] == quote;
    const std::size_t marks = is_long ? 3 : 1;
    for (std::size_t n = at + marks; n < text.size(); ++n) {
        if (text[n] == '\\' && quote == '"') {
            ++n;
        } else if (text[n] == quote && (!is_long || text.substr(n, 3) == triple)) {
            return n + marks;
        } else if (text[n] == '\n' && !is_long) {
            return n;
        }
    }
    return text.size();
}

bool ends_chain(char c) { return std::string_view("=,[]{}\n").find(c) != std::string_view::npos; }

}  // namespace

std::size_t line_of_deep_key(std::string_view toml) {
    std::size_t line = 1;
    std::size_t dots = 0;
    for (std::size_t at = 0; at < toml.size();) {
        const char c = toml[at];
        std::size_t next = at + 1;
        if (c == '#') {
            next = std::min(toml.find('\n', at), toml.size());
        } else if (c == '"' || c == '\'') {
            next = end_of_string(toml, at);
        } else if (ends_chain(c)) {
            dots = 0;
        } else if (c == '.' && ++dots == kDeepestKey) {
            return line;
        }
        line += static_cast<std::size_t>(
            std::count(toml.begin() + static_cast<std::ptrdiff_t>(at), toml.begin() + static_cast<std::ptrdiff_t>(next), '\n'));
        at = next;
    }
    return 0;
}

}  // namespace tricoil::host

#include "board/support/terminal_colour.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>

namespace tricoil::host {
namespace {

bool is_heading(std::string_view line) {
    const auto is_plain = [](unsigned char c) { return std::isalpha(c) != 0 || c == ' '; };
    return line.size() > 1 && line.front() != ' ' && line.back() == ':' && std::all_of(line.begin(), line.end() - 1, is_plain);
}

/// Paints the last word if it is `word`.
bool paint_last_word(std::string& line, std::string_view word, Colour colour) {
    if (!line.ends_with(" " + std::string(word))) {
        return false;
    }
    line = line.substr(0, line.size() - word.size()) + painted(word, colour);
    return true;
}

bool paint_prefix(std::string& line, std::string_view prefix, Colour colour) {
    if (!line.starts_with(prefix)) {
        return false;
    }
    line = painted(prefix, colour) + line.substr(prefix.size());
    return true;
}

std::string coloured_line(std::string line) {
    if (is_heading(line)) {
        return painted(line, Colour::bold);
    }
    if (line.starts_with("  # ")) {
        return painted(line, Colour::dim);
    }
    (void)(paint_prefix(line, "warning:", Colour::yellow) || paint_prefix(line, "tricoil:", Colour::yellow) ||
           paint_prefix(line, "Usage:", Colour::bold));
    (void)(paint_last_word(line, "FAIL", Colour::red) || paint_last_word(line, "pass", Colour::green));
    return line;
}

}  // namespace

bool has_colours(std::FILE* file) {
    const char* const refused = std::getenv("NO_COLOR");
    const char* const terminal = std::getenv("TERM");
    const bool is_dumb = terminal == nullptr || std::string_view(terminal) == "dumb";
    return (refused == nullptr || *refused == '\0') && !is_dumb && ::isatty(::fileno(file)) == 1;
}

std::string painted(std::string_view text, Colour colour) {
    constexpr int kCodes[] = {1, 2, 31, 32, 33};
    return fmt::format("\x1b[{}m{}\x1b[0m", kCodes[static_cast<std::size_t>(colour)], text);
}

std::string coloured_by_meaning(std::string_view text) {
    std::string out;
    while (!text.empty()) {
        const auto end = std::min(text.find('\n'), text.size());
        out += coloured_line(std::string(text.substr(0, end)));
        out += end < text.size() ? "\n" : "";
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return out;
}

}  // namespace tricoil::host

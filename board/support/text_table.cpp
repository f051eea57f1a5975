#include "board/support/text_table.hpp"

#include <cmath>

#include "board/support/errors.hpp"
#include "board/support/line_reader.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kShownCharacters = 24;
constexpr std::size_t kMaxBytes = std::size_t{256} << 20U;
constexpr std::size_t kMaxLines = 4'000'000;

std::string_view trim(std::string_view text) {
    const auto first = text.find_first_not_of(" \t\r");
    if (first == std::string_view::npos) {
        return {};
    }
    return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

/// Beginning of a field for a message, with unprintable characters replaced.
std::string shown(std::string_view field) {
    std::string text(field.substr(0, kShownCharacters));
    for (char& c : text) {
        c = (c >= ' ' && c <= '~') ? c : '?';
    }
    return field.size() > kShownCharacters ? text + "..." : text;
}

}  // namespace

std::vector<std::string> read_lines(const std::string& path) {
    LineReader reader(path);
    std::vector<std::string> lines;
    std::size_t bytes = 0;
    for (std::string line; reader.next(line);) {
        bytes += line.size();
        if (bytes > kMaxBytes || lines.size() == kMaxLines) {
            throw InputError(TextPlace{path, reader.line()}.str() +
                             ": the file is too long; at most 256 MiB and 4 million lines are read");
        }
        if (!line.empty() && line.back() == '\r') {
            line.pop_back();
        }
        lines.push_back(line);
    }
    refuse_if(lines.empty(), "{}: is empty", path);
    return lines;
}

std::vector<std::string_view> split(std::string_view line, char separator) {
    std::vector<std::string_view> fields;
    if (separator != ' ') {
        for (std::size_t begin = 0;;) {
            const auto end = line.find(separator, begin);
            fields.push_back(trim(line.substr(begin, end - begin)));
            if (end == std::string_view::npos) {
                return fields;
            }
            begin = end + 1;
        }
    }
    for (std::size_t begin = line.find_first_not_of(" \t"); begin != std::string_view::npos;) {
        const auto end = line.find_first_of(" \t", begin);
        fields.push_back(line.substr(begin, end - begin));
        begin = end == std::string_view::npos ? end : line.find_first_not_of(" \t", end);
    }
    return fields;
}

std::pair<std::string, std::string> key_and_value(std::string_view part, std::string_view owner) {
    const auto equals = part.find('=');
    refuse_if(equals == std::string_view::npos, "{}: '{}' is not KEY=VALUE", owner, part);
    return {std::string(part.substr(0, equals)), std::string(part.substr(equals + 1))};
}

double parse_number(std::string_view field, const TextPlace& place) {
    const auto value = number_from<double>(field);
    if (!value) {
        throw InputError(place.str() + ": '" + shown(field) + "' is not a number");
    }
    if (!std::isfinite(*value)) {
        throw InputError(place.str() + ": '" + shown(field) + "' is not finite; remove or repair the line");
    }
    return *value;
}

}  // namespace tricoil::host

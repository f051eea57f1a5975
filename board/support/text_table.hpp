// Numbers and cells in text. Every error message names file and line.
#pragma once

#include <fmt/format.h>

#include <charconv>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tricoil::host {

/// Place of a text in a file, for messages.
struct TextPlace {
    const std::string& path;
    std::size_t line;  // from 1
    [[nodiscard]] std::string str() const { return path + ":" + std::to_string(line); }
};

/// Fields of a line, split at `separator`, without the blanks around them.
std::vector<std::string_view> split(std::string_view line, char separator);

/// The two sides of KEY=VALUE. Throws InputError that begins with `owner` unless there is a '='.
std::pair<std::string, std::string> key_and_value(std::string_view part, std::string_view owner);

/// The number, if all of `text` is one. `base`: of integers.
template <typename Number, typename... Base>
std::optional<Number> number_from(std::string_view text, Base... base) {
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base...);
    return error == std::errc{} && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

/// Throws InputError unless `field` is exactly one finite number.
double parse_number(std::string_view field, const TextPlace& place);

/// Separator of the cells of a table, from its first row: semicolon, tab, comma or blank (any run of blanks).
char separator_of(std::string_view row);

/// Cells of a row, without the blanks and quotation marks around them. A separator in quotation marks is part of its cell.
void split_cells(std::string_view row, char separator, std::vector<std::string_view>& cells);

/// The number, if all of `cell` is one. A plus sign and a decimal comma are allowed.
std::optional<double> cell_number(std::string_view cell);

/// Beginning of a field for a message, with unprintable characters replaced.
std::string shown(std::string_view field);

}  // namespace tricoil::host

template <>
struct fmt::formatter<tricoil::host::TextPlace> : fmt::formatter<std::string> {
    auto format(const tricoil::host::TextPlace& place, fmt::format_context& context) const {
        return fmt::formatter<std::string>::format(place.str(), context);
    }
};

// Strict reader for text files of numbers. Every error message names file and line.
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

/// Lines of a text file, without line feeds. Throws InputError if the file cannot be opened, is empty, too long or not text,
/// ReadError if the disk fails.
std::vector<std::string> read_lines(const std::string& path);

/// Place of a text in a file, for messages.
struct TextPlace {
    const std::string& path;
    std::size_t line;  // from 1
    [[nodiscard]] std::string str() const { return path + ":" + std::to_string(line); }
};

/// Fields of a line, split at `separator`. A space splits at any run of blanks.
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

}  // namespace tricoil::host

template <>
struct fmt::formatter<tricoil::host::TextPlace> : fmt::formatter<std::string> {
    auto format(const tricoil::host::TextPlace& place, fmt::format_context& context) const {
        return fmt::formatter<std::string>::format(place.str(), context);
    }
};

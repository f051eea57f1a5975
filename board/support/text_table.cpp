#include "board/support/text_table.hpp"

#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kShownCharacters = 24;

std::string_view trim(std::string_view text) {
    const auto first = text.find_first_not_of(" \t\r");
    if (first == std::string_view::npos) {
        return {};
    }
    return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

/// The start of a field, made fit to print on one line.
std::string shown(std::string_view field) {
    std::string text(field.substr(0, kShownCharacters));
    for (char& c : text) {
        c = (c >= ' ' && c <= '~') ? c : '?';
    }
    return field.size() > kShownCharacters ? text + "..." : text;
}

}  // namespace

std::vector<std::string> read_lines(const std::string& path) {
    std::error_code error;
    if (std::filesystem::is_directory(path, error)) {
        throw InputError(path + ": is a folder; name a file");
    }
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        throw InputError(path + ": cannot be opened; check the path and its permissions");
    }
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) {
        if (line.find('\0') != std::string::npos) {
            throw InputError(TextPlace{path, lines.size() + 1}.str() + ": binary data; a text file is needed");
        }
        if (!line.empty() && line.back() == '\r') {
            line.pop_back();
        }
        lines.push_back(std::move(line));
    }
    if (lines.empty()) {
        throw InputError(path + ": is empty");
    }
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

double parse_number(std::string_view field, const TextPlace& place) {
    double value = 0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error != std::errc{} || end != field.data() + field.size()) {
        throw InputError(place.str() + ": '" + shown(field) + "' is not a number");
    }
    if (!std::isfinite(value)) {
        throw InputError(place.str() + ": '" + shown(field) + "' is not finite; remove or repair the line");
    }
    return value;
}

}  // namespace tricoil::host

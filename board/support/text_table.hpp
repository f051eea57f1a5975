// Text files of numbers, read strictly: every complaint names file and line.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace tricoil::host {

/// The lines of a text file, without their ends. Throws InputError if it cannot be opened, is empty, too long or not text;
/// ReadError if the disk fails before its end.
std::vector<std::string> read_lines(const std::string& path);

/// Where a piece of text stands, for messages.
struct TextPlace {
    const std::string& path;
    std::size_t line;  // from 1
    [[nodiscard]] std::string str() const { return path + ":" + std::to_string(line); }
};

/// Fields of a line, split at `separator`; a space separates at any run of blanks.
std::vector<std::string_view> split(std::string_view line, char separator);

/// The finite number that `field` holds, all of it. Throws InputError otherwise.
double parse_number(std::string_view field, const TextPlace& place);

}  // namespace tricoil::host

#include "board/support/text_table.hpp"

#include <algorithm>
#include <cmath>

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

}  // namespace

std::vector<std::string_view> split(std::string_view line, char separator) {
    std::vector<std::string_view> fields;
    for (std::size_t begin = 0;;) {
        const auto end = line.find(separator, begin);
        fields.push_back(trim(line.substr(begin, end - begin)));
        if (end == std::string_view::npos) {
            return fields;
        }
        begin = end + 1;
    }
}

std::string shown(std::string_view field) {
    std::string text(field.substr(0, kShownCharacters));
    for (char& c : text) {
        c = (c >= ' ' && c <= '~') ? c : '?';
    }
    return field.size() > kShownCharacters ? text + "..." : text;
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

void split_cells(std::string_view row, char separator, std::vector<std::string_view>& cells) {
    const std::string_view separators = separator == ' ' ? std::string_view(" \t\r") : std::string_view(&separator, 1);
    const std::string_view blanks = separator == '\t' ? " \r" : " \t\r";
    cells.clear();
    for (std::size_t begin = 0; begin <= row.size();) {
        begin = std::min(row.find_first_not_of(blanks, begin), row.size());
        if (separator == ' ' && begin == row.size()) {
            return;
        }
        const bool is_quoted = row.substr(begin).starts_with('"');
        const std::size_t end = std::min(row.find_first_of(separators, is_quoted ? row.find('"', begin + 1) : begin), row.size());
        std::string_view cell = trim(row.substr(begin, end - begin));
        if (is_quoted && cell.size() > 1 && cell.ends_with('"')) {
            cell = trim(cell.substr(1, cell.size() - 2));
        }
        cells.push_back(cell);
        begin = end + 1;
    }
}

char separator_of(std::string_view row) {
    std::vector<std::string_view> cells;
    for (const char separator : {';', '\t', ','}) {
        split_cells(row, separator, cells);
        // "0,5 0,25": decimal commas between blanks.
        const bool is_decimal =
            separator == ',' && std::ranges::any_of(cells, [](std::string_view cell) {
                return cell_number(cell.substr(0, cell.find(' '))) && cell.find(' ') != std::string_view::npos;
            });
        if (cells.size() > 1 && !is_decimal) {
            return separator;
        }
    }
    return ' ';
}

std::optional<double> cell_number(std::string_view cell) {
    std::string text(cell.substr(cell.starts_with('+') ? 1 : 0));
    const bool has_sign = text.starts_with('-') || text.starts_with('+');
    if (const std::size_t comma = text.find(','); comma != std::string::npos && text.find('.') == std::string::npos) {
        text[comma] = '.';
    }
    return cell.starts_with('+') && has_sign ? std::nullopt : number_from<double>(text);
}

}  // namespace tricoil::host

// Text from JSON: the text output of a command is made from its JSON output.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/linear/matrix.hpp"

namespace tricoil::host {

using Json = nlohmann::ordered_json;

/// Returns `text` with each `{KEY}`, `{KEY:FORMAT}` and `{KEY in UNIT:FORMAT}` replaced by a value of `values`. KEY may be a
/// path: `latency_us/max`, `singular_values/0`. FORMAT as in fmt. UNIT converts from the SI unit, or a ratio to %. An object of
/// counts is replaced by their sum. Throws a std::exception for an unknown key or unit, and for a FORMAT that does not suit.
std::string fill(const Json& values, std::string_view text);

/// JSON as text: one line, or indented. Bytes that are not UTF-8, as in names of files and damaged lines, are replaced.
template <typename AnyJson = Json>
std::string json_line(const AnyJson& value, int indent = -1) {
    return value.dump(indent, ' ', false, AnyJson::error_handler_t::replace);
}

/// Prints a command's result as JSON, or as the text that `text_of` makes of it.
void print_result(const Json& result, bool as_json, std::string (*text_of)(const Json& result));

inline Json list_of(const Vec3<double>& v) { return {v(0), v(1), v(2)}; }

/// A list of three rows.
inline Json rows_of(const Mat3<double>& m) {
    Json rows = Json::array();
    for (Index i = 0; i < 3; ++i) {
        rows.push_back({m(i, 0), m(i, 1), m(i, 2)});
    }
    return rows;
}

/// Sets `v` and returns true if `list` is a list of three numbers.
inline bool read_list(const nlohmann::json& list, Vec3<double>& v) {
    bool whole = list.is_array() && list.size() == 3;
    for (std::size_t i = 0; i < 3 && whole; ++i) {
        whole = list[i].is_number();
        v(static_cast<Index>(i)) = whole ? list[i].get<double>() : 0;
    }
    return whole;
}

/// The same for a list of three rows.
inline bool read_rows(const nlohmann::json& rows, Mat3<double>& m) {
    bool whole = rows.is_array() && rows.size() == 3;
    for (std::size_t i = 0; i < 3 && whole; ++i) {
        Vec3<double> row;
        whole = read_list(rows[i], row);
        m.row(static_cast<Index>(i)) = row;
    }
    return whole;
}

/// A line for each of the "warnings" of a result.
std::string warnings_text(const Json& result);

}  // namespace tricoil::host

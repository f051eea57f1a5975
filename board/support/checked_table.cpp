#include "board/support/checked_table.hpp"

#include <fmt/format.h>
#include <algorithm>

#include <cmath>
#include <optional>

#include "board/support/errors.hpp"
#include "board/support/nearest_name.hpp"

namespace tricoil::host {
namespace {

const toml::table kEmptyTable{};

/// Numbers of an array; empty if the node is not an array of `count` numbers.
std::vector<double> numbers_of(const toml::node& node, std::size_t count) {
    std::vector<double> values;
    const toml::array* array = node.as_array();
    for (std::size_t i = 0; array != nullptr && array->size() == count && i < count; ++i) {
        const auto value = (*array)[i].value<double>();
        if (!value || !std::isfinite(*value)) {
            return {};
        }
        values.push_back(*value);
    }
    return values;
}

// toml++ limits only the depth of values and recurses for every part of a key.
constexpr std::size_t kDeepestKey = 16;  // parts of one dotted key

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

/// Line (from 1) of the first key with more than kDeepestKey parts (a.b.c has three); 0 if there is none.
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

}  // namespace

toml::table parse_toml(const std::string& name, std::string_view text) {
    if (const std::size_t line = line_of_deep_key(text); line != 0) {
        throw InputError(name + ":" + std::to_string(line) + ": a key of more than " + std::to_string(kDeepestKey) + " parts");
    }
    try {
        return toml::parse(text, name);
    } catch (const toml::parse_error& error) {
        throw InputError(name + ":" + std::to_string(error.source().begin.line) + ": " + std::string(error.description()));
    }
}

CheckedTable::CheckedTable(std::string file, std::string prefix, const toml::table& table)
    : file_(std::move(file)), prefix_(std::move(prefix)), table_(&table) {}

/// `convert`: the value of a node; empty if it is not what `wanted` says.
template <typename Value, typename Convert>
Value CheckedTable::read(const std::string& key, const Value& fallback, const std::string& wanted, const Convert& convert) {
    const toml::node* node = find(key);
    if (node == nullptr) {
        return fallback;
    }
    const std::optional<Value> value = convert(*node);
    if (!value) {
        throw_error(key, node, wanted);
    }
    return *value;
}

double CheckedTable::number(const std::string& key, double fallback) {
    return read(key, fallback, "must be a finite number", [](const toml::node& node) {
        const auto value = node.value<double>();
        return value && std::isfinite(*value) ? value : std::nullopt;
    });
}

double CheckedTable::positive(const std::string& key, double fallback) {
    const double value = number(key, fallback);
    if (!(value > 0)) {
        throw_error(key, find(key), "must be greater than zero");
    }
    return value;
}

bool CheckedTable::flag(const std::string& key, bool fallback) {
    return read(key, fallback, "must be true or false", [](const toml::node& node) { return node.value_exact<bool>(); });
}

std::uint64_t CheckedTable::whole(const std::string& key, std::uint64_t fallback, std::uint64_t most) {
    return read(key, fallback, fmt::format("must be a whole number from 0 to {}", most), [most](const toml::node& node) {
        const auto value = node.value_exact<std::int64_t>();
        const bool fits = value && *value >= 0 && static_cast<std::uint64_t>(*value) <= most;
        return fits ? std::optional(static_cast<std::uint64_t>(*value)) : std::nullopt;
    });
}

std::string CheckedTable::text(const std::string& key, const std::string& fallback) {
    return read(key, fallback, "must be a string in quotes", [](const toml::node& node) { return node.value<std::string>(); });
}

std::string CheckedTable::choice(const std::string& key, const std::vector<std::string>& choices) {
    const std::string value = text(key, "");
    if (value.empty()) {
        need(key);
        throw_error(key, find(key), "is empty");
    }
    try {
        return choices[index_of_name("value", value, choices)];
    } catch (const InputError& error) {
        throw_error(key, find(key), std::string("has the ") + error.what());
    }
}

std::vector<std::string> CheckedTable::texts(const std::string& key) {
    const toml::node* node = find(key);
    std::vector<std::string> values;
    if (node == nullptr) {
        return values;
    }
    const toml::array* array = node->as_array();
    for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
        values.push_back((*array)[i].value_or<std::string>(""));
    }
    if (array == nullptr || std::find(values.begin(), values.end(), "") != values.end()) {
        throw_error(key, node, "must be a list of strings");
    }
    return values;
}

Vec3<double> CheckedTable::vector(const std::string& key, const Vec3<double>& fallback) {
    return read(key, fallback, "must be three finite numbers, as [0.5, 0, 0]", [](const toml::node& node) {
        const auto values = numbers_of(node, 3);
        return values.empty() ? std::nullopt : std::optional(Vec3<double>(values.data()));
    });
}

Mat3<double> CheckedTable::matrix(const std::string& key, const Mat3<double>& fallback) {
    const toml::node* node = find(key);
    if (node == nullptr) {
        return fallback;
    }
    Mat3<double> matrix;
    const toml::array* rows = node->as_array();
    for (std::size_t i = 0; i < 3; ++i) {
        const auto row = rows != nullptr && rows->size() == 3 ? numbers_of((*rows)[i], 3) : std::vector<double>{};
        if (row.empty()) {
            throw_error(key, node, "must be three rows of three finite numbers");
        }
        matrix.row(static_cast<Index>(i)) << row[0], row[1], row[2];
    }
    return matrix;
}

std::vector<int> CheckedTable::integers(const std::string& key, std::size_t count, int most) {
    need(key);
    const toml::node* node = find(key);
    std::vector<int> values;
    const toml::array* array = node->as_array();
    for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
        const auto value = (*array)[i].value_exact<std::int64_t>();
        if (value && *value >= -most && *value <= most) {
            values.push_back(static_cast<int>(*value));
        }
    }
    if (values.size() != count || array->size() != count) {
        throw_error(key, node, fmt::format("must be {} whole numbers from {} to {}", count, -most, most));
    }
    return values;
}

CheckedTable CheckedTable::child(const std::string& key) {
    const toml::node* node = find(key);
    if (node != nullptr && !node->is_table()) {
        throw_error(key, node, "must be a table, [" + key + "]");
    }
    return {file_, prefix_ + key + ".", node == nullptr ? kEmptyTable : *node->as_table()};
}

std::vector<CheckedTable> CheckedTable::children(const std::string& key) {
    const toml::node* node = find(key);
    std::vector<CheckedTable> tables;
    const toml::array* array = node == nullptr ? nullptr : node->as_array();
    for (std::size_t i = 0; array != nullptr && i < array->size(); ++i) {
        if (const toml::table* table = (*array)[i].as_table()) {
            tables.emplace_back(file_, prefix_ + key + ".", *table);
        }
    }
    if (node != nullptr && (array == nullptr || tables.size() != array->size())) {
        throw_error(key, node, "must be tables, [[" + key + "]]");
    }
    return tables;
}

void CheckedTable::need(const std::string& key) {
    if (find(key) != nullptr) {
        return;
    }
    for (const auto& [other, node] : *table_) {
        const std::string typed(other.str());
        if (!known_.contains(typed) && !nearest_name(typed, {key}).empty()) {
            throw_error(key, &node, "is missing; '" + prefix_ + typed + "' is not a known key");
        }
    }
    throw_error(key, nullptr, "is missing");
}

void CheckedTable::require(bool good, const std::string& key, const std::string& what) {
    if (!good) {
        throw_error(key, find(key), what);
    }
}

void CheckedTable::finish() const {
    for (const auto& [key, node] : *table_) {
        const std::string name(key.str());
        if (!known_.contains(name)) {
            const std::string nearest = nearest_name(name, {known_.begin(), known_.end()});
            throw_error(name, &node,
                        nearest.empty() ? "is not a known key" : "is not a known key; did you mean '" + nearest + "'?");
        }
    }
}

const toml::node* CheckedTable::find(const std::string& key) {
    known_.insert(key);
    return table_->get(key);
}

void CheckedTable::throw_error(const std::string& key, const toml::node* node, const std::string& what) const {
    const bool has_line = node != nullptr && node->source().begin.line > 0;  // a table that was not read from a file has none
    const std::string line = has_line ? fmt::format(":{}", node->source().begin.line) : "";
    throw InputError(file_ + line + ": '" + prefix_ + key + "' " + what);
}

}  // namespace tricoil::host

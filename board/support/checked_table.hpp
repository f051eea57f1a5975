// TOML table with strict checks of types, ranges and unknown keys. Messages name file, line and key.
#pragma once

#include <fmt/format.h>
#include <toml++/toml.h>

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/linear/matrix.hpp"

namespace tricoil::host {

/// Maximum size of a TOML file in bytes. A longer file is refused before it is parsed.
constexpr std::size_t kLongestToml = std::size_t{4} << 20U;

/// Throws InputError with place and reason if `text` is not TOML. `name`: file name for messages.
toml::table parse_toml(const std::string& name, std::string_view text);

/// Every getter returns the fallback if the key is absent, and throws InputError if its value has a wrong type or range.
class CheckedTable {
public:
    /// `table` must outlive this object. `prefix`: path of the table within the file, for example "motion.".
    CheckedTable(std::string file, std::string prefix, const toml::table& table);

    bool has(const std::string& key) { return find(key) != nullptr; }
    double number(const std::string& key, double fallback);
    double positive(const std::string& key, double fallback);
    bool flag(const std::string& key, bool fallback);
    std::uint64_t whole(const std::string& key, std::uint64_t fallback, std::uint64_t most);  // 0 to most
    std::string text(const std::string& key, const std::string& fallback);
    std::string choice(const std::string& key, const std::vector<std::string>& choices);  // required
    std::vector<std::string> texts(const std::string& key);
    Vec3<double> vector(const std::string& key, const Vec3<double>& fallback);
    Mat3<double> matrix(const std::string& key, const Mat3<double>& fallback);  // three rows of three
    /// `count` whole numbers from -most to most; required.
    std::vector<int> integers(const std::string& key, std::size_t count, int most);
    CheckedTable child(const std::string& key);  // an absent table is returned empty

    std::vector<CheckedTable> children(const std::string& key);  // [[key]]; none if absent

    /// Throws InputError if the key is absent; names an unread key of the table that is nearly the same.
    void need(const std::string& key);

    /// Throws InputError with file, line and key if `good` is false. `what`: the violated requirement.
    void require(bool good, const std::string& key, const std::string& what);

    /// Throws InputError for keys that no getter has read.
    void finish() const;

private:
    const toml::node* find(const std::string& key);
    template <typename Value, typename Convert>
    Value read(const std::string& key, const Value& fallback, const std::string& wanted, const Convert& convert);
    [[noreturn]] void throw_error(const std::string& key, const toml::node* node, const std::string& what) const;

    std::string file_;
    std::string prefix_;
    const toml::table* table_;
    std::set<std::string> known_;
};

// Vectors and matrices as TOML.

/// Reads back as the same bits.
inline std::string toml_text(const Vec3<double>& v) { return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", v(0), v(1), v(2)); }

/// Three rows.
inline std::string toml_text(const Mat3<double>& m) {
    return fmt::format("[\n  {},\n  {},\n  {},\n]", toml_text(Vec3<double>(m.row(0))), toml_text(Vec3<double>(m.row(1))),
                       toml_text(Vec3<double>(m.row(2))));
}

}  // namespace tricoil::host

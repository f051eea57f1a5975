// Table with named columns, read from CSV files of the program or of recordings.
#pragma once

#include <algorithm>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace tricoil::test {

class CsvTable {
public:
    explicit CsvTable(const std::string& text) {
        std::istringstream stream(text);
        std::string line;
        std::getline(stream, line);
        names_ = fields(line);
        while (std::getline(stream, line)) {
            rows_.push_back(fields(line));
        }
    }

    std::size_t rows() const { return rows_.size(); }

    const std::string& text(std::size_t row, const std::string& name) const {
        const auto found = std::find(names_.begin(), names_.end(), name);
        if (found == names_.end()) {
            throw std::out_of_range("no column '" + name + "'");
        }
        return rows_.at(row).at(static_cast<std::size_t>(found - names_.begin()));
    }

    /// Number of one field; NaN if it is empty.
    double number(std::size_t row, const std::string& name) const {
        const std::string& field = text(row, name);
        return field.empty() ? std::numeric_limits<double>::quiet_NaN() : std::stod(field);
    }

private:
    static std::vector<std::string> fields(const std::string& line) {
        std::vector<std::string> found(1);
        for (const char c : line) {
            c == ',' ? static_cast<void>(found.emplace_back()) : found.back().push_back(c);
        }
        return found;
    }

    std::vector<std::string> names_;
    std::vector<std::vector<std::string>> rows_;
};

}  // namespace tricoil::test

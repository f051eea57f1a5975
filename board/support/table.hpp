// The one reader of tables: rows of cells below a line of names, as spreadsheets, loggers and these programs write them.
#pragma once

#include <array>
#include <cstddef>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "board/support/line_reader.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host {

/// Comment above couplings to which --wiring was applied.
constexpr std::string_view kOfCoilsComment = "# wiring corrected";

/// Cells are separated by semicolons, tabs, commas or blanks, which the first row determines; quotation marks and blanks around
/// them do not count. Comments (lines that begin with #), blank lines and rows of empty cells are skipped. The file is read row
/// by row. All functions throw InputError that names file and line.
class Table {
public:
    /// Reads to the end of the first row. Throws also if there is none, and like table_of_arrays().
    explicit Table(const std::string& path);
    explicit Table(LineReader lines);
    Table(const Table&) = delete;
    Table& operator=(const Table&) = delete;

    /// False if the first row has a number: it is data, and cells are found by their number.
    [[nodiscard]] bool has_names() const { return !names_.empty(); }
    /// Goes to the next row; false at the end. Throws for another number of cells than the first row has.
    bool next();
    [[nodiscard]] TextPlace place() const { return {lines_.path(), row_}; }
    [[nodiscard]] const std::string& path() const { return lines_.path(); }

    [[nodiscard]] bool is_of_coils() const { return is_of_coils_; }  // a comment so far is kOfCoilsComment
    [[nodiscard]] bool has(std::string_view name) const { return find(name) < names_.size(); }
    /// Index of a column. `expected`: what the header must have, for the message about a missing or repeated name.
    [[nodiscard]] std::size_t column(std::string_view name, std::string_view expected) const;
    /// Cells of this row.
    [[nodiscard]] const std::vector<std::string_view>& cells() const { return cells_; }
    /// Throws unless the cell is a finite number.
    [[nodiscard]] double number(std::size_t column) const;
    /// Throws unless it is a whole number from `low` to `high`.
    [[nodiscard]] int whole(std::size_t column, int low, int high) const;
    /// Name of a column for messages.
    [[nodiscard]] std::string name(std::size_t column) const;

private:
    bool read_row();
    void drop_empty_cells(std::size_t least);
    [[nodiscard]] std::size_t find(std::string_view name) const;

    LineReader lines_;
    std::string line_;
    char separator_ = '\0';  // not yet known
    std::vector<std::string> names_;
    std::vector<std::string_view> cells_;
    std::size_t columns_ = 0;
    std::size_t header_ = 0;  // line of the first row
    std::size_t row_ = 0;     // line of this row
    bool is_first_row_ = false;
    bool is_of_coils_ = false;
};

}  // namespace tricoil::host

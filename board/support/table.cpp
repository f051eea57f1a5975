#include "board/support/table.hpp"

#include <algorithm>
#include <cmath>

#include "board/support/errors.hpp"
#include "board/support/python_part.hpp"

namespace tricoil::host {

namespace {

LineReader lines_of(const std::string& path) {
    const drivers::FileDescriptor table = table_of_arrays(path);
    return LineReader(path, table.is_open() ? fmt::format("/proc/self/fd/{}", table.get()) : "");
}

}  // namespace

Table::Table(const std::string& path) : Table(lines_of(path)) {}

Table::Table(LineReader lines) : lines_(std::move(lines)) {
    refuse_if(!read_row(), "{}: is empty; a table is needed", path());
    header_ = row_;
    drop_empty_cells(1);
    columns_ = cells_.size();
    is_first_row_ = std::ranges::any_of(cells_, [](std::string_view cell) { return cell_number(cell).has_value(); });
    if (!is_first_row_) {
        names_.assign(cells_.begin(), cells_.end());
    }
}

bool Table::read_row() {
    while (lines_.next(line_)) {
        lines_.refuse_long();
        const std::size_t begin = line_.find_first_not_of(" \t\r");
        is_of_coils_ = is_of_coils_ || line_.starts_with(kOfCoilsComment);
        if (begin == std::string::npos || line_[begin] == '#') {
            continue;
        }
        separator_ = separator_ == '\0' ? separator_of(line_) : separator_;
        split_cells(line_, separator_, cells_);
        if (std::ranges::any_of(cells_, [](std::string_view cell) { return !cell.empty(); })) {
            row_ = lines_.line();
            return true;
        }
    }
    return false;
}

/// Of a spreadsheet whose rows end with separators.
void Table::drop_empty_cells(std::size_t least) {
    while (cells_.size() > least && cells_.back().empty()) {
        cells_.pop_back();
    }
}

bool Table::next() {
    if (!std::exchange(is_first_row_, false) && !read_row()) {
        return false;
    }
    drop_empty_cells(columns_);
    refuse_if(cells_.size() != columns_, "{}: {} columns; {} are needed, as in line {}", place(), cells_.size(), columns_,
              header_);
    return true;
}

std::size_t Table::find(std::string_view name) const {
    return static_cast<std::size_t>(std::ranges::find(names_, name) - names_.begin());
}

std::size_t Table::column(std::string_view name, std::string_view expected) const {
    const auto times = std::ranges::count(names_, name);
    const TextPlace header{path(), header_};
    refuse_if(!has_names(), "{}: has numbers; the header must have {}", header, expected);
    refuse_if(times != 1, "{}: {} column {}; the header must have {}", header, times == 0 ? "no" : "more than one", name,
              expected);
    return find(name);
}

std::string Table::name(std::size_t column) const { return has_names() ? names_[column] : fmt::format("column {}", column + 1); }

double Table::number(std::size_t column) const {
    const std::string_view cell = cells_.at(column);
    const auto value = cell_number(cell);
    if (!value || !std::isfinite(*value)) {
        throw InputError(fmt::format("{}: {}: '{}' is not {}", place(), name(column), shown(cell),
                                     value ? "finite; remove or repair the line" : "a number"));
    }
    return *value;
}

int Table::whole(std::size_t column, int low, int high) const {
    const double value = number(column);
    refuse_if(value != std::floor(value) || value < low || value > high, "{}: {}: {} is not a whole number from {} to {}",
              place(), name(column), cells_[column], low, high);
    return static_cast<int>(value);
}

}  // namespace tricoil::host

// CSV of poses, as the commands write it: columns by name, lengths in any unit of --units.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/linear/quaternion.hpp"

namespace tricoil::host {

/// Lines below a header, one by one. All functions throw InputError that names file and line.
class PoseTable {
public:
    /// lines: of the file `path`, the header first. Throws for a header without positions.
    PoseTable(std::string path, std::vector<std::string> lines);
    PoseTable(const PoseTable&) = delete;
    PoseTable& operator=(const PoseTable&) = delete;

    /// Goes to the next line; false at the end. Throws for another number of fields than the header has.
    bool next();
    /// "FILE:LINE" of the line.
    [[nodiscard]] std::string where() const { return path_ + ":" + std::to_string(line_ + 1); }

    /// Throws for a missing column, unless there is a number for its absence.
    [[nodiscard]] double number(std::string_view column, std::optional<double> absent = std::nullopt) const;
    /// From x_U, y_U, z_U with a unit U.
    [[nodiscard]] Vec3<double> position_m() const { return lengths_m({"x_", "y_", "z_"}); }
    /// From qw to qz.
    [[nodiscard]] Quat<double> attitude() const;
    /// Standard deviations of position (m) and small rotation (rad).
    [[nodiscard]] Vec6<double> deviations() const;

private:
    [[nodiscard]] std::size_t index_of(std::string_view column) const;
    [[nodiscard]] Vec3<double> lengths_m(const std::array<const char*, 3>& names) const;

    std::string path_;
    std::vector<std::string> lines_;
    std::vector<std::string_view> names_;
    std::vector<std::string_view> fields_;
    std::string unit_;
    double units_per_m_ = 1;
    std::size_t line_ = 0;
};

/// Throws InputError, beginning with `where`, unless its length is 1, to 1 %.
Quat<double> normalised(const Quat<double>& q, const std::string& where);

}  // namespace tricoil::host

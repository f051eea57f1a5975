// Table of poses, as the commands write it: columns by name, lengths in any unit of --units.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "board/support/table.hpp"
#include "core/linear/quaternion.hpp"

namespace tricoil::host {

/// Poses of the rows of a table. All functions throw InputError that names file and line.
class PoseTable {
public:
    /// Throws for a header without positions.
    explicit PoseTable(const Table& table);

    /// True for a table with positions.
    [[nodiscard]] static bool in(const Table& table);

    /// Throws for a missing column, unless there is a number for its absence.
    [[nodiscard]] double number(std::string_view column, std::optional<double> absent = std::nullopt) const;
    /// From x_U, y_U, z_U with a unit U.
    [[nodiscard]] Vec3<double> position_m() const { return lengths_m({"x_", "y_", "z_"}); }
    /// From qw to qz. `tolerance`: of its length.
    [[nodiscard]] Quat<double> attitude(double tolerance = 0.01) const;
    /// Standard deviations of position (m) and small rotation (rad).
    [[nodiscard]] Vec6<double> deviations() const;

private:
    [[nodiscard]] Vec3<double> lengths_m(const std::array<const char*, 3>& names) const;

    const Table& table_;
    std::string unit_;
    double units_per_m_ = 1;
};

/// Throws InputError, beginning with `where`, unless its length is 1 within the tolerance.
Quat<double> normalised(const Quat<double>& q, const std::string& where, double tolerance = 0.01);

}  // namespace tricoil::host

// Table of poses, as the commands write it: columns by name, lengths in any unit of --units.
#pragma once

#include <string>

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

    /// From x_U, y_U, z_U with a unit U.
    [[nodiscard]] Vec3<double> position_m() const;
    /// From qw to qz. `tolerance`: of its length.
    [[nodiscard]] Quat<double> attitude(double tolerance = 0.01) const;

private:
    /// Throws for a missing column.
    [[nodiscard]] double number(const std::string& column) const;

    const Table& table_;
    std::string unit_;
    double units_per_m_ = 1;
};

/// Throws InputError, beginning with `where`, unless its length is 1 within the tolerance.
Quat<double> normalised(const Quat<double>& q, const std::string& where, double tolerance = 0.01);

}  // namespace tricoil::host

#include "board/pose_text/pose_table.hpp"

#include <algorithm>
#include <cmath>

#include "board/pose_text/pose_fields.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host {

namespace {

constexpr const char* kExpected = "x_m,y_m,z_m (or mm, cm or in instead of m) and qw,qx,qy,qz, as that of run --out";

auto unit_of(const Table& table) {
    return std::ranges::find_if(kLengthUnits, [&](const std::string& unit) { return table.has("x_" + unit); });
}

}  // namespace

bool PoseTable::in(const Table& table) { return unit_of(table) != kLengthUnits.end(); }

PoseTable::PoseTable(const Table& table) : table_(table) {
    const auto unit = unit_of(table);
    unit_ = unit == kLengthUnits.end() ? "m" : *unit;
    (void)table.column("x_" + unit_, kExpected);
    units_per_m_ = kUnitsPerMetre.at(static_cast<std::size_t>(unit - kLengthUnits.begin()));
}

double PoseTable::number(const std::string& column) const { return table_.number(table_.column(column, kExpected)); }

Vec3<double> PoseTable::position_m() const {
    return Vec3<double>{number("x_" + unit_), number("y_" + unit_), number("z_" + unit_)} / units_per_m_;
}

Quat<double> PoseTable::attitude(double tolerance) const {
    return normalised({number("qw"), number("qx"), number("qy"), number("qz")}, table_.place().str(), tolerance);
}

Quat<double> normalised(const Quat<double>& q, const std::string& where, double tolerance) {
    refuse_if(!(std::abs(q.norm() - 1) <= tolerance), "{}: quaternion has length {:.6g}, not 1", where, q.norm());
    return q.normalized();
}

}  // namespace tricoil::host

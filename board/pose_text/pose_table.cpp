#include "board/pose_text/pose_table.hpp"

#include <algorithm>
#include <cmath>

#include "board/pose_text/pose_fields.hpp"
#include "board/support/errors.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host {

PoseTable::PoseTable(std::string path, std::vector<std::string> lines)
    : path_(std::move(path)), lines_(std::move(lines)), names_(split(lines_.front(), ',')) {
    const auto unit =
        std::ranges::find_if(kLengthUnits, [&](const std::string& name) { return index_of("x_" + name) < names_.size(); });
    refuse_if(unit == kLengthUnits.end(), "{}:1: no column x_m; poses have x_m, y_m and z_m, or mm, cm or in instead of m",
              path_);
    unit_ = *unit;
    units_per_m_ = kUnitsPerMetre.at(static_cast<std::size_t>(unit - kLengthUnits.begin()));
}

bool PoseTable::next() {
    if (++line_ >= lines_.size()) {
        return false;
    }
    fields_ = split(lines_[line_], ',');
    refuse_if(fields_.size() != names_.size(), "{}: {} fields; the header has {}", where(), fields_.size(), names_.size());
    return true;
}

std::size_t PoseTable::index_of(std::string_view column) const {
    return static_cast<std::size_t>(std::find(names_.begin(), names_.end(), column) - names_.begin());
}

double PoseTable::number(std::string_view column, std::optional<double> absent) const {
    if (const std::size_t at = index_of(column); at < names_.size()) {
        return parse_number(fields_[at], {path_, line_ + 1});
    }
    refuse_if(!absent, "{}:1: no column {}; give the file of run --out, or the folder of a recording", path_, column);
    return *absent;
}

Vec3<double> PoseTable::lengths_m(const std::array<const char*, 3>& names) const {
    Vec3<double> lengths;
    for (std::size_t i = 0; i < 3; ++i) {
        lengths(static_cast<Index>(i)) = number(names[i] + unit_) / units_per_m_;
    }
    return lengths;
}

Quat<double> PoseTable::attitude() const { return normalised({number("qw"), number("qx"), number("qy"), number("qz")}, where()); }

Vec6<double> PoseTable::deviations() const {
    Vec6<double> deviations;
    deviations << lengths_m({"std_x_", "std_y_", "std_z_"}), number("std_rx_rad"), number("std_ry_rad"), number("std_rz_rad");
    return deviations;
}

Quat<double> normalised(const Quat<double>& q, const std::string& where) {
    constexpr double kTolerance = 0.01;
    refuse_if(!(std::abs(q.norm() - 1) <= kTolerance), "{}: quaternion has length {:.3f}, not 1", where, q.norm());
    return q.normalized();
}

}  // namespace tricoil::host

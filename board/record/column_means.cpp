#include "board/record/column_means.hpp"

#include <algorithm>

namespace tricoil::host {
namespace {

bool is_used(const TrackerInput& input) { return has_couplings(input) && !input.column.flags.has(ColumnFlag::low_band); }

}  // namespace

/// Reads the next usable column. False at the end.
bool ColumnMeans::advance() {
    has_next_ = false;
    for (std::string line; !has_next_ && lines_.next(line);) {
        next_ = parse_input(line, lines_.where());
        has_next_ = is_used(next_);
    }
    return has_next_;
}

void ColumnMeans::skip_to_restart() {
    for (DeviceTime last = next_.column.midpoint; has_next_ && next_.column.midpoint >= last; (void)advance()) {
        last = next_.column.midpoint;
    }
}

auto ColumnMeans::between(DeviceTime from, DeviceTime to) -> Means {
    Means sum{Mat3<double>::Zero(), {Mat3<double>::Zero(), -1}};
    Vec3<double> count = Vec3<double>::Zero();
    bool has_levels = true;
    for (bool more = has_next_ || advance(); more && next_.column.midpoint <= to; more = advance()) {
        const MeasuredColumn<double>& column = next_.column;
        if (column.midpoint < from) {
            continue;
        }
        const int coil = coil_index(column.state);
        sum.quadrature.col(coil) += column.quadrature;
        sum.levels.share.col(coil) += Vec3<double>(column.level[0], column.level[1], column.level[2]) / kLevelsPerFullScale;
        has_levels = has_levels && std::find(column.level.begin(), column.level.end(), 0) == column.level.end();
        has_levels = has_levels && (sum.levels.gain_step < 0 || sum.levels.gain_step == column.gain_step);
        sum.levels.gain_step = column.gain_step;
        count(coil) += 1;
    }
    sum.quadrature = sum.quadrature * count.cwiseInverse().asDiagonal();
    sum.levels.share = sum.levels.share * count.cwiseInverse().asDiagonal();
    if (!has_levels || sum.levels.gain_step < 0) {
        sum.levels = {Mat3<double>::Zero(), 0};
    }
    return sum;
}

}  // namespace tricoil::host

#include "board/record/column_quadratures.hpp"

namespace tricoil::host {
namespace {

bool is_used(const TrackerInput& input) { return has_couplings(input) && !input.column.flags.has(ColumnFlag::low_band); }

}  // namespace

/// Reads the next usable column. False at the end.
bool ColumnQuadratures::advance() {
    has_next_ = false;
    for (std::string line; !has_next_ && lines_.next(line);) {
        next_ = parse_input(line, lines_.where());
        has_next_ = is_used(next_);
    }
    return has_next_;
}

void ColumnQuadratures::skip_to_restart() {
    for (DeviceTime last = next_.column.midpoint; has_next_ && next_.column.midpoint >= last; (void)advance()) {
        last = next_.column.midpoint;
    }
}

Mat3<double> ColumnQuadratures::mean(DeviceTime from, DeviceTime to) {
    Mat3<double> sum = Mat3<double>::Zero();
    Vec3<double> count = Vec3<double>::Zero();
    for (bool more = has_next_ || advance(); more && next_.column.midpoint <= to; more = advance()) {
        if (next_.column.midpoint >= from) {
            const int coil = coil_index(next_.column.state);
            sum.col(coil) += next_.column.quadrature;
            count(coil) += 1;
        }
    }
    return sum.array().rowwise() / count.transpose().array();
}

}  // namespace tricoil::host

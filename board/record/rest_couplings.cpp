#include "board/record/rest_couplings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

constexpr double kTolerance = 0.01;
constexpr Microseconds kShortest{500'000};
constexpr Microseconds kMargin{100'000};

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

RestFinder::RestFinder(Put put, const std::string& folder) : put_(std::move(put)), folder_(folder), means_(folder) {
    put_("rest,start_s,duration_s,x11,x12,x13,x21,x22,x23,x31,x32,x33" + std::string(kQuadratureColumns) +
         std::string(kLevelColumns) + "\n");
}

void RestFinder::add(DeviceTime time, const Mat3<double>& x) {
    const auto count = static_cast<double>(rest_.size());
    if (!rest_.empty() && !((count * x - sum_).norm() <= kTolerance * sum_.norm())) {
        end_rest();
    }
    rest_.push_back({time, x});
    sum_ += x;
}

void RestFinder::end_rest() {
    const std::vector<Matrix> rest = std::exchange(rest_, {});
    sum_.setZero();
    if (rest.empty() || rest.back().time - rest.front().time < kShortest) {
        return;
    }
    const DeviceTime from = rest.front().time + kMargin;
    const DeviceTime to = rest.back().time - kMargin;
    Mat3<double> sum = Mat3<double>::Zero();
    int used = 0;
    for (const Matrix& matrix : rest) {
        if (matrix.time >= from && matrix.time <= to) {
            sum += matrix.x;
            ++used;
        }
    }
    const auto [quadrature, levels] = means_.between(from, to);
    if (used == 0 || !quadrature.allFinite()) {  // the columns in the middle of the rest are missing
        return;
    }
    put_(fmt::format("{},{:.3f},{:.3f}", ++rests_, to_seconds(rest.front().time),
                     to_seconds(rest.back().time - rest.front().time)) +
         "," + matrix_text(sum / used) + "," + matrix_text(quadrature) + "," + matrix_text(levels.share) +
         fmt::format(",{}\n", levels.gain_step));
}

int RestFinder::finish() {
    end_rest();
    refuse_if(rests_ == 0, "{}: the sensor never rests; hold it still for 0.5 s or longer at each place", folder_);
    return rests_;
}

void RestFinder::restart() {
    end_rest();
    means_.skip_to_restart();
}

}  // namespace tricoil::host

// Couplings of a sensor that a user places by hand: the mean over each rest of a recording.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "board/record/recording.hpp"
#include "board/support/coupling_text.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host {

/// Mean quadratures and levels of the couplings in a recording. Reads the columns of the first sensor, once.
class ColumnMeans {
public:
    struct Means {
        Mat3<double> quadrature;  // NaN for a source coil without columns
        SignalLevels levels;      // unknown if the gain step changed
    };

    /// Throws like RecordLines.
    explicit ColumnMeans(const std::string& folder) : lines_(folder, RecordFile::inputs) {}

    /// Over the columns between two times, without those of a fault. Each call begins after the times of the call before. Throws
    /// InputError for a damaged line.
    Means between(DeviceTime from, DeviceTime to) {
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

    /// Skips the columns up to the next one that is older than the one before: the device's clock started again.
    void skip_to_restart() {
        for (DeviceTime last = next_.column.midpoint; has_next_ && next_.column.midpoint >= last; (void)advance()) {
            last = next_.column.midpoint;
        }
    }

private:
    static bool is_used(const TrackerInput& input) {
        return has_couplings(input) && !input.column.flags.has(ColumnFlag::low_band);
    }
    /// Reads the next usable column. False at the end.
    bool advance() {
        has_next_ = false;
        for (std::string line; !has_next_ && lines_.next(line);) {
            next_ = parse_input(line, lines_.where());
            has_next_ = is_used(next_);
        }
        return has_next_;
    }

    RecordLines lines_;
    TrackerInput next_;
    bool has_next_ = false;
};

/// A rest lasts 0.5 s or longer; meanwhile the signal matrix stays within 1 % of its mean (about 1 mm at 0.4 m). Its first and
/// last 0.1 s are left out of the mean.
class RestFinder {
public:
    using Put = std::function<void(std::string_view)>;

    /// Writes CSV lines: number, start and duration of the rest (s), nine couplings, their quadratures and levels, and the gain
    /// step. Writes the header at once. `folder`: of the recording. Throws like ColumnMeans.
    RestFinder(Put put, const std::string& folder) : put_(std::move(put)), folder_(folder), means_(folder) {
        put_("rest,start_s,duration_s,x11,x12,x13,x21,x22,x23,x31,x32,x33" + std::string(kQuadratureColumns) +
             std::string(kLevelColumns) + "\n");
    }

    void add(DeviceTime time, const Mat3<double>& x) {
        const auto count = static_cast<double>(rest_.size());
        if (!rest_.empty() && !((count * x - sum_).norm() <= kTolerance * sum_.norm())) {
            end_rest();
        }
        rest_.push_back({time, x});
        sum_ += x;
    }
    /// Returns the number of rests. Throws InputError, naming the folder, if there is none.
    int finish() {
        end_rest();
        refuse_if(rests_ == 0, "{}: the sensor never rests; hold it still for 0.5 s or longer at each place", folder_);
        return rests_;
    }
    /// The clock of the device started again.
    void restart() {
        end_rest();
        means_.skip_to_restart();
    }

private:
    static constexpr double kTolerance = 0.01;
    static constexpr Microseconds kShortest{500'000};
    static constexpr Microseconds kMargin{100'000};

    struct Matrix {
        DeviceTime time;
        Mat3<double> x;
    };
    void end_rest() {
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

    Put put_;
    std::string folder_;
    ColumnMeans means_;
    std::vector<Matrix> rest_;
    Mat3<double> sum_ = Mat3<double>::Zero();
    int rests_ = 0;
};

}  // namespace tricoil::host

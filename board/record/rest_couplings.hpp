// Couplings of a sensor that a user places by hand: the mean over each rest of a recording.
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "board/record/column_means.hpp"
#include "core/base/time.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::host {

/// A rest lasts 0.5 s or longer; meanwhile the signal matrix stays within 1 % of its mean (about 1 mm at 0.4 m). Its first and
/// last 0.1 s are left out of the mean.
class RestFinder {
public:
    using Put = std::function<void(std::string_view)>;
    using MeansBetween = std::function<ColumnMeans::Means(DeviceTime from, DeviceTime to)>;

    /// Writes CSV lines: number, start and duration of the rest (s), nine couplings, their quadratures and levels, and the gain
    /// step. Writes the header at once. `means` is called with times in order.
    RestFinder(Put put, MeansBetween means);

    void add(DeviceTime time, const Mat3<double>& x);
    void finish();

private:
    struct Matrix {
        DeviceTime time;
        Mat3<double> x;
    };
    void end_rest();

    Put put_;
    MeansBetween means_;
    std::vector<Matrix> rest_;
    Mat3<double> sum_ = Mat3<double>::Zero();
    int rests_ = 0;
};

}  // namespace tricoil::host

// Couplings of a sensor that a user places by hand: the mean over each rest of a recording.
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "core/base/time.hpp"
#include "core/geometry/types.hpp"

namespace tricoil::host {

/// A rest lasts 0.5 s or longer; meanwhile the signal matrix stays within 1 % of its mean (about 1 mm at 0.4 m). Its first and
/// last 0.1 s are left out of the mean.
class RestFinder {
public:
    using Put = std::function<void(std::string_view)>;
    /// Mean quadratures of the couplings between two times; NaN for a source coil without columns.
    using Quadratures = std::function<Mat3<double>(DeviceTime from, DeviceTime to)>;

    /// Writes CSV lines: number, start and duration of the rest (s), nine couplings, and their quadratures. Writes the header at
    /// once. `quadratures` is called with times in order.
    RestFinder(Put put, Quadratures quadratures);

    void add(DeviceTime time, const Mat3<double>& x);
    void finish();

private:
    struct Matrix {
        DeviceTime time;
        Mat3<double> x;
    };
    void end_rest();

    Put put_;
    Quadratures quadratures_;
    std::vector<Matrix> rest_;
    Mat3<double> sum_ = Mat3<double>::Zero();
    int rests_ = 0;
};

}  // namespace tricoil::host

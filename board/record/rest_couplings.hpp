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

    /// Writes CSV lines: number, start and duration of the rest (s), and nine couplings. Writes the header at once.
    explicit RestFinder(Put put);

    void add(DeviceTime time, const Mat3<double>& x);
    void finish();

private:
    struct Matrix {
        double time_s;
        Mat3<double> x;
    };
    void end_rest();

    Put put_;
    std::vector<Matrix> rest_;
    Mat3<double> sum_ = Mat3<double>::Zero();
    int rests_ = 0;
};

}  // namespace tricoil::host

// Ratio of the couplings of two bands without metal.
#pragma once

#include <array>

#include "core/geometry/types.hpp"

namespace tricoil::host {

/// Least squares over means of simultaneous columns of both bands, for each coupling. The ratio does not depend on the pose, so
/// the sensor may move. Errors of a low coupling do not depend on its size. A mean over a whole number of mains cycles contains
/// no hum.
class BandRatio {
public:
    /// `window`: columns of each mean.
    explicit BandRatio(int window) : window_(window) {}

    /// Couplings of the sensor coils to source coil j at the same time.
    void add(int j, const Vec3<double>& high, const Vec3<double>& low);
    /// Begins a new mean for source coil j: columns are missing.
    void restart(int j) { means_[static_cast<std::size_t>(j)] = {}; }

    [[nodiscard]] int columns() const { return columns_; }
    /// (i, j): sensor coil i, source coil j. NaN without columns.
    [[nodiscard]] Mat3<double> ratio() const;
    /// Standard deviation of the ratio, from the residuals.
    [[nodiscard]] Mat3<double> sigma() const;

private:
    struct Mean {
        Vec3<double> high = Vec3<double>::Zero();
        Vec3<double> low = Vec3<double>::Zero();
        int columns = 0;
    };

    int window_;
    std::array<Mean, 3> means_;  // of each source coil
    Mat3<double> high_high_ = Mat3<double>::Zero();
    Mat3<double> low_high_ = Mat3<double>::Zero();
    Mat3<double> low_low_ = Mat3<double>::Zero();
    Vec3<double> count_ = Vec3<double>::Zero();  // means per source coil
    int columns_ = 0;
};

}  // namespace tricoil::host

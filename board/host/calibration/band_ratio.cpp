#include "board/host/calibration/band_ratio.hpp"

#include <cmath>

namespace tricoil::host {

void BandRatio::add(int j, const Vec3<double>& high, const Vec3<double>& low, const Vec3<double>& low_quadrature) {
    constexpr double kRest = 1e-3;  // change within a mean, relative: causes a quadrature of 2e-5
    ++columns_;
    Mean& mean = means_[static_cast<std::size_t>(j)];
    mean.high += high / window_;
    mean.change += (mean.columns < window_ / 2 ? -high : high) * 2 / window_;
    mean.low += low / window_;
    mean.low_quadrature += low_quadrature / window_;
    if (++mean.columns < window_) {
        return;
    }
    in_phase_.add(j, mean.high, mean.low);
    if (mean.change.norm() <= kRest / 2 * mean.high.norm()) {
        quadrature_.add(j, mean.high, mean.low_quadrature);
    }
    mean = {};
}

bool BandRatio::knows_phases() const {
    constexpr double kFewest = 5;  // means
    constexpr double kLargestSigma_rad = 5e-3;
    return quadrature_.count.minCoeff() >= kFewest && !quadrature_.low_low.isZero(0) &&
           phase_sigma_rad().maxCoeff() <= kLargestSigma_rad;
}

Mat3<double> BandRatio::ratio() const {
    if (!knows_phases()) {
        return in_phase_.slope();
    }
    return in_phase_.slope().binaryExpr(quadrature_.slope(), [](double x, double y) { return std::hypot(x, y); });
}

Mat3<double> BandRatio::phase_rad() const {
    return quadrature_.slope().binaryExpr(in_phase_.slope(), [](double y, double x) { return std::atan2(y, x); });
}

void BandRatio::Regression::add(int j, const Vec3<double>& high, const Vec3<double>& low) {
    high_high.col(j) += high.cwiseAbs2();
    low_high.col(j) += low.cwiseProduct(high);
    low_low.col(j) += low.cwiseAbs2();
    count(j) += 1;
}

Mat3<double> BandRatio::Regression::sigma() const {
    const Mat3<double> residual = (low_low - slope().cwiseProduct(low_high)).cwiseMax(0);
    Mat3<double> freedom;
    freedom.rowwise() = count - Vec3<double>::Ones();
    return residual.cwiseQuotient(freedom.cwiseProduct(high_high)).cwiseSqrt();
}

}  // namespace tricoil::host

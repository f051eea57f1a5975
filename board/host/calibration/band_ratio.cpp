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

void MotionLag::add(const Mat3<double>& in_phase, const Mat3<double>& quadrature, double variance, double frame_s) {
    constexpr int kForRate = 2;  // earlier frames
    if (frames_++ >= kForRate) {
        const auto& [middle, first] = before_;
        const Mat3<double> rate = (in_phase - first.in_phase) / (2 * frame_s);
        rate_rate_ += rate.transpose() * rate;
        rate_rate_.diagonal() -=
            Vec3<double>::Constant(3 * variance / (2 * frame_s * frame_s));  // the rate's noise would bias the lag towards zero
        rate_quadrature_ += rate.transpose() * middle.quadrature;
        quadrature_squared_ += middle.quadrature.colwise().squaredNorm().transpose();
        count_ += 1;
    }
    before_ = {Frame{in_phase, quadrature}, before_[0]};
}

Mat3<double> MotionLag::lag_s() const { return rate_rate_.inverse() * rate_quadrature_; }

Mat3<double> MotionLag::sigma_s() const {
    const Mat3<double> inverse = rate_rate_.inverse();
    const Vec3<double> explained = lag_s().cwiseProduct(rate_quadrature_).colwise().sum().transpose();
    const Vec3<double> variance = (quadrature_squared_ - explained).cwiseMax(0) / (3 * count_ - 3);
    return (inverse.diagonal() * variance.transpose()).cwiseSqrt();
}

bool MotionLag::is_known() const {
    constexpr double kFewest = 100;         // frames
    constexpr double kLargestSigma = 0.01;  // of the lag; three source coils add to 2 %
    const double largest_s = kLargestSigma * lag_s().colwise().norm().minCoeff();
    return count_ >= kFewest && !quadrature_squared_.isZero(0) && sigma_s().maxCoeff() <= largest_s;
}

}  // namespace tricoil::host

#include "board/host/calibration/motion_lag.hpp"

namespace tricoil::host {

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

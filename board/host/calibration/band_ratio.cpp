#include "board/host/calibration/band_ratio.hpp"

namespace tricoil::host {

void BandRatio::add(int j, const Vec3<double>& high, const Vec3<double>& low) {
    ++columns_;
    Mean& mean = means_[static_cast<std::size_t>(j)];
    mean.high += high / window_;
    mean.low += low / window_;
    if (++mean.columns < window_) {
        return;
    }
    high_high_.col(j) += mean.high.cwiseAbs2();
    low_high_.col(j) += mean.low.cwiseProduct(mean.high);
    low_low_.col(j) += mean.low.cwiseAbs2();
    count_(j) += 1;
    mean = {};
}

Mat3<double> BandRatio::ratio() const { return low_high_.cwiseQuotient(high_high_); }

Mat3<double> BandRatio::sigma() const {
    const Mat3<double> residual = (low_low_ - ratio().cwiseProduct(low_high_)).cwiseMax(0);
    const Mat3<double> freedom = (count_.transpose().array() - 1).replicate<3, 1>().matrix();
    return residual.cwiseQuotient(freedom.cwiseProduct(high_high_)).cwiseSqrt();
}

}  // namespace tricoil::host

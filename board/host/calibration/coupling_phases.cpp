#include "board/host/calibration/coupling_phases.hpp"

#include <algorithm>
#include <cmath>

#include "board/host/calibration/fit_quality.hpp"
#include "core/tracking/judge/quadrature_check.hpp"

namespace tricoil::host {

void CouplingPhases::add(const Mat3<double>& in_phase, const Mat3<double>& quadrature) {
    const double weight = 1 / (in_phase.squaredNorm() + quadrature.squaredNorm());
    squares_ += in_phase.binaryExpr(quadrature,
                                    [weight](double i, double q) { return weight * std::complex(i, q) * std::complex(i, q); });
    power_ += weight * (in_phase.cwiseAbs2() + quadrature.cwiseAbs2());
}

Mat3<double> CouplingPhases::phase_rad() const {
    constexpr double kWeakest = 3e-3;     // of the squares of a channel: a coupling of 5 % of the others; crosstalk is weaker
    constexpr double kLargest_rad = 0.1;  // from the channel's phase: more is crosstalk
    Mat3<double> phase_rad = Mat3<double>::Zero();
    for (int i = 0; i < 3; ++i) {
        const double channel_rad = std::arg(std::complex<double>(squares_.row(i).sum())) / 2;
        for (int j = 0; j < 3; ++j) {
            // Relative to the channel, so that all couplings of a channel keep the same sign.
            const double own_rad = std::arg(squares_(i, j) * std::polar(1.0, -2 * channel_rad)) / 2;
            const bool is_known = power_(i, j) > kWeakest * power_.row(i).sum() && std::abs(own_rad) < kLargest_rad;
            phase_rad(i, j) = channel_rad + (is_known ? own_rad : 0);
        }
    }
    return phase_rad;
}

void correct_columns(const CoilCorrection& correction, Mat3<double>& in_phase, Mat3<double>& quadrature) {
    for (int j = 0; j < 3; ++j) {
        Vec3<double> x = in_phase.col(j);
        Vec3<double> y = quadrature.col(j);
        Vec3<double> sigma = Vec3<double>::Zero();  // not used
        correction.correct_column(j, x, y, sigma);
        in_phase.col(j) = x;
        quadrature.col(j) = y;
    }
}

double quadrature_share(const CoilCorrection& correction, Mat3<double> in_phase, Mat3<double> quadrature) {
    correct_columns(correction, in_phase, quadrature);
    return quadrature.norm() / std::hypot(in_phase.norm(), quadrature.norm());
}

double quadrature_floor_of(std::vector<double> shares) {
    constexpr std::size_t kFewest = 18;
    if (shares.size() < kFewest) {
        return 1;
    }
    const double limit = kOutlierMedians * median(shares);
    std::erase_if(shares, [&](double share) { return share > limit; });
    const double largest = *std::max_element(shares.begin(), shares.end());
    return largest / std::sqrt(6.0);  // |X|^2 = 3/2 k^2 by (6): a share s is a mean of the nine squares of s^2 k^2 / 6
}

bool exceeds_quadrature_floor(double share, double floor) {
    const double third_of_sum = share * share / 2;  // of the nine squares, relative to k^2
    return third_of_sum > tracking::QuadratureCheck<double>::gate({}) * floor * floor;
}

}  // namespace tricoil::host

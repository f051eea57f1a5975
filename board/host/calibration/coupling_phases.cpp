#include "board/host/calibration/coupling_phases.hpp"

#include <algorithm>
#include <cmath>

#include "core/tracking/quadrature_check.hpp"

namespace tricoil::host {

void CouplingPhases::add(const Mat3<double>& in_phase, const Mat3<double>& quadrature) {
    const double weight = 1 / (in_phase.squaredNorm() + quadrature.squaredNorm());
    squares_.real() += weight * (in_phase.cwiseAbs2() - quadrature.cwiseAbs2());
    squares_.imag() += weight * 2 * in_phase.cwiseProduct(quadrature);
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

void remove_phases(const Mat3<double>& phase_rad, Mat3<double>& in_phase, Mat3<double>& quadrature) {
    const auto cosine = phase_rad.array().cos();
    const auto sine = phase_rad.array().sin();
    const Mat3<double> along = cosine * in_phase.array() + sine * quadrature.array();
    quadrature = cosine * quadrature.array() - sine * in_phase.array();
    in_phase = along;
}

double quadrature_share(const calibration::CoilCorrection<double>& correction, const Mat3<double>& in_phase,
                        const Mat3<double>& quadrature) {
    double in_phase_squared = 0;
    double squared = 0;
    for (int j = 0; j < 3; ++j) {
        Vec3<double> x = in_phase.col(j);
        Vec3<double> y = quadrature.col(j);
        Vec3<double> sigma = Vec3<double>::Zero();
        correction.correct_without_phases(j, x, y, sigma);
        in_phase_squared += x.squaredNorm();
        squared += y.squaredNorm();
    }
    return std::sqrt(squared / (in_phase_squared + squared));
}

double quadrature_floor_of(std::vector<double> shares) {
    constexpr std::size_t kFewest = 18;
    constexpr double kOutlier = 8;
    if (shares.size() < kFewest) {
        return 1;
    }
    std::sort(shares.begin(), shares.end());
    const double limit = kOutlier * shares[shares.size() / 2];
    const auto largest = std::prev(std::upper_bound(shares.begin(), shares.end(), limit));
    return *largest / std::sqrt(6.0);  // |X|^2 = 3/2 k^2 by (6): a share s is a mean of the nine squares of s^2 k^2 / 6
}

bool exceeds_quadrature_floor(double share, double floor) {
    const double third_of_sum = share * share / 2;  // of the nine squares, relative to k^2
    return third_of_sum > tracking::QuadratureCheck<double>::gate({}) * floor * floor;
}

}  // namespace tricoil::host

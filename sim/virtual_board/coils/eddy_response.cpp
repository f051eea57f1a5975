#include "sim/virtual_board/coils/eddy_response.hpp"

#include <cmath>
#include <complex>
#include <numbers>

#include "sim/dense_algebra.hpp"

namespace tricoil::virtual_board {
namespace {

// Corner frequencies a factor of 3 apart, around and between the carriers.
constexpr std::array<double, EddyResponse::kPoles> kCorners_hz{100, 330, 1000, 3300, 10e3, 33e3, 100e3};

constexpr double time_constant_s(std::size_t pole) { return 1 / (2 * std::numbers::pi * kCorners_hz[pole]); }

}  // namespace

const std::vector<double>& EddyResponse::tones_hz() {
    static const std::vector<double> tones{250, 400, 640, 1000, 2000, 4000, 7000, 9600, 11e3, 14e3, 20e3};
    return tones;
}

EddyResponse::EddyResponse() {
    const auto tones = static_cast<Index>(tones_hz().size());
    Eigen::MatrixXd basis(2 * tones, static_cast<Index>(kTerms));
    for (Index k = 0; k < tones; ++k) {
        basis(k, 0) = 1;
        basis(k + tones, 0) = 0;
        for (std::size_t p = 0; p < kPoles; ++p) {
            const std::complex<double> ratio(0, tones_hz()[static_cast<std::size_t>(k)] / kCorners_hz[p]);
            const std::complex<double> response = ratio / (1.0 + ratio);
            basis(k, static_cast<Index>(p + 1)) = response.real();
            basis(k + tones, static_cast<Index>(p + 1)) = response.imag();
        }
    }
    inverse_ = pseudo_inverse(basis);
}

EddyResponse::Terms EddyResponse::fit(const std::vector<sim::ComplexMat3>& fields) const {
    Terms terms;
    const auto tones = static_cast<Index>(fields.size());
    for (std::size_t p = 0; p < kTerms; ++p) {
        terms[p].setZero();
        for (Index k = 0; k < tones; ++k) {
            const sim::ComplexMat3& field = fields[static_cast<std::size_t>(k)];
            const auto row = static_cast<Index>(p);
            terms[p] += inverse_(row, k) * field.real() + inverse_(row, k + tones) * field.imag();
        }
    }
    return terms;
}

void LoopCurrents::advance(double step_s, double before, double after, double current) {
    currents_[0] = current;
    derivatives_[0] = after;
    for (std::size_t p = 0; p < EddyResponse::kPoles; ++p) {
        // r' = i' - r/T with i' linear in time.
        const double t = time_constant_s(p);
        const double decay = std::exp(-step_s / t);
        double& r = currents_[p + 1];
        r = r * decay + before * t * (1 - decay) + (after - before) * t * (1 - t * (1 - decay) / step_s);
        derivatives_[p + 1] = after - r / t;
    }
}

}  // namespace tricoil::virtual_board

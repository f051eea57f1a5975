// The response of metal to arbitrary coil currents, from its response to sine waves.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "sim/dense_algebra.hpp"
#include "sim/world/metal/metal_set.hpp"

namespace tricoil::virtual_board {

/// The currents of the board are not sine waves, so the field of the metal is written as a sum of R-L loops,
/// D(w) = D_0 + sum of D_p i w T_p / (1 + i w T_p), with fixed time constants T_p and real matrices D_p that fit the response at
/// tones_hz(). Eddy currents are such a sum (Wait 1951). The fit is within 2 % of the largest response for the presets.
class EddyResponse {
public:
    static constexpr std::size_t kPoles = 7;
    static constexpr std::size_t kTerms = kPoles + 1;
    using Terms = std::array<Mat3<double>, kTerms>;  // D_0, D_1 ...

    // Corner frequencies a factor of 3 apart, around and between the carriers.
    static constexpr std::array<double, kPoles> kCorners_hz{100, 330, 1000, 3300, 10e3, 33e3, 100e3};
    static constexpr double time_constant_s(std::size_t pole) { return 1 / (2 * std::numbers::pi * kCorners_hz[pole]); }

    /// The frequencies that fit() needs.
    static const std::vector<double>& tones_hz() {
        static const std::vector<double> tones{250, 400, 640, 1000, 2000, 4000, 7000, 9600, 11e3, 14e3, 20e3};
        return tones;
    }

    EddyResponse() {
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

    /// `fields`: at tones_hz().
    [[nodiscard]] Terms fit(const std::vector<sim::ComplexMat3>& fields) const {
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

private:
    Eigen::MatrixXd inverse_;  // kTerms x 2 tones
};

/// The part of one coil's current that flows in each R-L loop; the first is the current itself.
class LoopCurrents {
public:
    /// Advances by `step_s`, over which the current's rate of change goes from `before` to `after` linearly.
    void advance(double step_s, double before, double after, double current) {
        currents_[0] = current;
        derivatives_[0] = after;
        for (std::size_t p = 0; p < EddyResponse::kPoles; ++p) {
            // r' = i' - r/T with i' linear in time.
            const double t = EddyResponse::time_constant_s(p);
            const double decay = std::exp(-step_s / t);
            double& r = currents_[p + 1];
            r = r * decay + before * t * (1 - decay) + (after - before) * t * (1 - t * (1 - decay) / step_s);
            derivatives_[p + 1] = after - r / t;
        }
    }
    [[nodiscard]] const std::array<double, EddyResponse::kTerms>& currents() const { return currents_; }
    [[nodiscard]] const std::array<double, EddyResponse::kTerms>& derivatives() const { return derivatives_; }

private:
    std::array<double, EddyResponse::kTerms> currents_{};
    std::array<double, EddyResponse::kTerms> derivatives_{};
};

}  // namespace tricoil::virtual_board

// Mean quadrature of the high band: it shows metal that is too small for the misfit and for the low band.
#pragma once

#include <algorithm>
#include <array>

#include "core/linear/matrix.hpp"

namespace tricoil::tracking {

struct MeanQuadratureParams {
    double frame_s = 1.0 / 240;
    int frames = 24;                                   // memory
    double lag_s = 1e-4;                               // as CommonParams::quadrature_lag_s
    Mat3<double> motion_lag_s = Mat3<double>::Zero();  // as calibration::LowBand; zero: unknown
};

/// Eddy currents cause a quadrature. So does motion: it is subtracted if the calibration knows it, otherwise it counts as noise.
/// Noise falls with the number of frames, so the mean shows a seventh of what QuadratureCheck sees in one frame.
class MeanQuadrature {
public:
    explicit MeanQuadrature(const MeanQuadratureParams& params) : params_(params) {}

    void clear() { *this = MeanQuadrature(params_); }

    /// The next frame: couplings in phase and in quadrature. variance: of one coupling's noise.
    void add(const Mat3<double>& in_phase, const Mat3<double>& quadrature, double variance) {
        constexpr int kForRate = 2;  // earlier frames
        if (frames_++ >= kForRate) {
            const Mat3<double> rate = (3 * in_phase - 4 * before_[0] + before_[1]) / (2 * params_.frame_s);
            const double weight = 1.0 / std::min(frames_ - kForRate, params_.frames);
            quadrature_ += weight * (quadrature - rate * params_.motion_lag_s - quadrature_);
            rate_ += weight * (rate - rate_);
            variance_ += weight * (weight * variance - (2 - weight) * variance_);
        }
        before_ = {in_phase, before_[0]};
    }

    /// Variance that the metal may have added to an in-phase coupling. floor: quadrature of clean coils, coupling units.
    [[nodiscard]] double effect_variance(double floor) const {
        // Chi-square per degree of freedom, of nine; one of six clean means exceeds it a little. Chosen with the ratio over
        // random objects.
        constexpr double kChance = 1.4;
        constexpr double kEffect = 6;       // in-phase effect over quadrature
        constexpr double kLagError = 0.02;  // of the calibrated lag
        const double lag_s = (params_.motion_lag_s.isZero(0) ? 1 : kLagError) * params_.lag_s;
        const double expected = variance_ + lag_s * lag_s * rate_.squaredNorm() / 9 + floor * floor;
        return kEffect * kEffect * std::max(quadrature_.squaredNorm() / 9 - kChance * expected, 0.0);
    }

private:
    MeanQuadratureParams params_;
    std::array<Mat3<double>, 2> before_{Mat3<double>::Zero(), Mat3<double>::Zero()};  // in phase, the newest first
    int frames_ = 0;
    Mat3<double> quadrature_ = Mat3<double>::Zero();  // mean
    Mat3<double> rate_ = Mat3<double>::Zero();        // mean
    double variance_ = 0;                             // of quadrature_ by noise
};

}  // namespace tricoil::tracking

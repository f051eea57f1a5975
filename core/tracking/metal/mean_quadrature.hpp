// Mean quadrature of the high band: it shows metal that is too small for the misfit and for the low band.
#pragma once

#include <algorithm>
#include <array>

#include "core/tracking/tracker_params.hpp"

namespace tricoil::tracking {

/// Eddy currents cause a quadrature. So does motion: it is subtracted if the calibration knows it, otherwise it counts as noise.
/// Noise falls with the number of frames, so the mean shows a seventh of what QuadratureCheck sees in one frame.
class MeanQuadrature {
public:
    /// The window of `bands` is the memory. lag_s: as CommonParams::quadrature_lag_s. motion_lag_s: as in calibration::LowBand;
    /// zero: unknown.
    MeanQuadrature(const DualBandParams& bands, double lag_s, const Mat3<double>& motion_lag_s)
        : bands_(bands), lag_s_(lag_s), motion_lag_s_(motion_lag_s) {}

    void clear() { *this = MeanQuadrature(bands_, lag_s_, motion_lag_s_); }

    /// The next frame: couplings in phase and in quadrature. variance: of one coupling's noise.
    void add(const Mat3<double>& in_phase, const Mat3<double>& quadrature, double variance) {
        constexpr int kForRate = 2;  // earlier frames
        if (frames_++ >= kForRate) {
            const Mat3<double> rate = (3 * in_phase - 4 * before_[0] + before_[1]) / (2 * bands_.frame_s);
            const double weight = 1.0 / std::min(frames_ - kForRate, bands_.window_frames);
            quadrature_ += weight * (quadrature - rate * motion_lag_s_ - quadrature_);
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
        constexpr double kEffect = 6;  // in-phase effect over quadrature
        const double lag_s = motion_lag_s_.isZero(0) ? lag_s_ : 0;
        const double expected = variance_ + lag_s * lag_s * rate_.squaredNorm() / 9 + floor * floor;
        return kEffect * kEffect * std::max(quadrature_.squaredNorm() / 9 - kChance * expected, 0.0);
    }

private:
    DualBandParams bands_;
    double lag_s_;
    Mat3<double> motion_lag_s_;
    std::array<Mat3<double>, 2> before_{Mat3<double>::Zero(), Mat3<double>::Zero()};  // in phase, the newest first
    int frames_ = 0;
    Mat3<double> quadrature_ = Mat3<double>::Zero();  // mean
    Mat3<double> rate_ = Mat3<double>::Zero();        // mean
    double variance_ = 0;                             // of quadrature_ by noise
};

}  // namespace tricoil::tracking

// Ratios of the metal's signals to its effect on the high band, from the misfits.
#pragma once

#include "core/tracking/metal/metal_spectrum.hpp"
#include "core/tracking/metal/pose_information.hpp"

namespace tricoil::tracking {

/// Column i: what signal i adds to the nine couplings.
using SignalCouplings = Matrix<double, 9, 3>;

/// Three of nine couplings are redundant. No pose changes them, so there the effect of the metal on the high band is known, and
/// the ratio of each signal to it follows by least squares.
class SignalRatios {
public:
    /// frames: length of the windows.
    explicit SignalRatios(int frames) : frame_weight_(1.0 / frames) {}

    /// Means over a window, once a frame, in coupling units: misfits of the signals and of the high band. variance: of each
    /// signal of one coupling.
    void add(const SignalCouplings& signals, const Vec9& high, const MetalSignals& variance) {
        const Vec3<double> weight = frame_weight_ * variance.cwiseInverse();
        signal_high_ = (1 - frame_weight_) * signal_high_ + weight.cwiseProduct(signals.transpose() * high);
        high_high_ = (1 - frame_weight_) * high_high_ + weight * high.squaredNorm();
    }

    [[nodiscard]] MetalSignals value() const { return signal_high_.cwiseQuotient(high_high_); }
    /// By the noise of the signals.
    [[nodiscard]] MetalSignals variance() const { return high_high_.cwiseInverse(); }

private:
    double frame_weight_;
    Vec3<double> signal_high_ = Vec3<double>::Zero();
    Vec3<double> high_high_ = Vec3<double>::Zero();
};

}  // namespace tricoil::tracking

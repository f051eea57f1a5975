// Noise of the samples, measured together with the signal by a short filter that suppresses the carriers.
#pragma once

#include <array>
#include <span>

#include "core/signal/acquisition_plan.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::signal {

/// The filter (1 - z^-1) times (1 - 2 cos(w) z^-1 + z^-2) per carrier has exact zeros at direct current and at the carriers. It
/// suppresses offset and signal completely and slow amplitude changes almost completely; white noise passes with a known gain.
/// Unlike the residual of a fit it needs no difference of large numbers, so it works in float at 100 dB and more.
template <typename Scalar>
class NoiseEstimator {
public:
    NoiseEstimator() = default;
    explicit NoiseEstimator(const AcquisitionPlan& plan);

    /// Standard deviation of one sample, in codes, per channel. Assumes white noise; interference counts as noise.
    [[nodiscard]] std::array<Scalar, kChannels> sample_sigma(std::span<const Sample> window) const;

private:
    static constexpr int kMaxTaps = 2 + 2 * kMaxCarriers;
    std::array<Scalar, kMaxTaps> taps_{};
    int tap_count_ = 0;
    Scalar noise_gain_ = 1;  // sum of squared taps
};

extern template class NoiseEstimator<float>;
extern template class NoiseEstimator<double>;

}  // namespace tricoil::signal

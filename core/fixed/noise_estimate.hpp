// Noise of the samples in integers. Twin of signal::NoiseEstimator.
#pragma once

#include <array>
#include <span>

#include "core/fixed/acquisition.hpp"
#include "core/fixed/fixed.hpp"

namespace tricoil::fixed {

/// Variance of one sample per channel, in codes squared times 2^16.
using SampleVariances = std::array<std::int64_t, kChannels>;

/// Variance of quantisation: 1/12 of a code squared. It is the lower limit of every variance.
constexpr std::int64_t kQuantisationQ16 = (1 << 16) / 12;

/// The filter (1 - z^-1) times (1 - 2 cos(w) z^-1 + z^-2) per carrier. It suppresses the offset and the carriers.
class NoiseEstimator {
public:
    explicit NoiseEstimator(const Acquisition& acquisition);

    /// Filter outputs are limited to 2^19 codes. Noise does not reach this limit; larger signals set other flags.
    [[nodiscard]] SampleVariances sample_variance(std::span<const Sample> window) const;

private:
    static constexpr std::size_t kMaxTaps = 2 + 2 * kSourceCoils;
    // Q25: a tap is at most 35, the sum of magnitudes at most 2 * 4^3 = 128.
    std::array<std::int32_t, kMaxTaps> taps_{};
    std::size_t tap_count_ = 0;
    std::int64_t gain_q8_ = 1;  // sum of squared taps, at least 2
};

}  // namespace tricoil::fixed

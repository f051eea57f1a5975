// Noise of the samples in integers: signal::NoiseEstimator for parts without a floating-point unit.
#pragma once

#include <array>
#include <span>

#include "core/fixed/acquisition.hpp"
#include "core/fixed/fixed.hpp"

namespace tricoil::fixed {

/// Per channel, of one sample, in codes squared times 2^16.
using SampleVariances = std::array<std::int64_t, kChannels>;

/// What a quantiser adds by itself: a twelfth of a code squared. No variance is ever below it.
constexpr std::int64_t kQuantisationQ16 = (1 << 16) / 12;

/// The filter (1 - z^-1) times (1 - 2 cos(w) z^-1 + z^-2) per carrier, which neither offset nor carriers pass.
class NoiseEstimator {
public:
    explicit NoiseEstimator(const Acquisition& acquisition);

    /// Filter outputs beyond 2^19 codes count as that: no noise comes near, and what reaches it is flagged elsewhere.
    [[nodiscard]] SampleVariances sample_variance(std::span<const Sample> window) const;

private:
    static constexpr std::size_t kMaxTaps = 2 + 2 * kSourceCoils;
    // Q25: a tap is at most 35, their sizes' sum at most 2 4^3 = 128.
    std::array<std::int32_t, kMaxTaps> taps_{};
    std::size_t tap_count_ = 0;
    std::int64_t gain_q8_ = 1;  // sum of squared taps, at least 2
};

}  // namespace tricoil::fixed

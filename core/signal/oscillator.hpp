// Reference oscillator: unit phasor exp(-i w n) for n = 0, 1, 2, ... without a sine per sample.
#pragma once

#include <array>
#include <complex>

#include "core/signal/sample_block.hpp"
#include "core/signal/unit_phasor.hpp"

namespace tricoil::signal {

/// Within a segment the phasor is computed by recurrence. Each segment starts from an exact value, so rounding errors accumulate
/// over one segment only (in float: below 2e-6).
constexpr int kSegmentSamples = 32;

template <typename Scalar>
class Oscillator {
public:
    Oscillator() = default;

    /// `cycles` whole cycles in `window_samples` samples.
    Oscillator(int cycles, int window_samples) {
        step_ = phasor(cycles, window_samples, 1);
        for (std::size_t segment = 0; segment < segments_.size(); ++segment) {
            segments_[segment] = phasor(cycles, window_samples, static_cast<long>(segment) * kSegmentSamples);
        }
    }

    [[nodiscard]] std::complex<Scalar> step() const { return step_; }
    [[nodiscard]] std::complex<Scalar> at_segment(int segment) const { return segments_[static_cast<std::size_t>(segment)]; }

private:
    static std::complex<Scalar> phasor(int cycles, int window_samples, long n) {
        const auto part = static_cast<double>((n * cycles) % window_samples) / window_samples;  // reduced exactly
        return static_cast<std::complex<Scalar>>(unit_phasor(part));
    }

    std::complex<Scalar> step_{1, 0};
    std::array<std::complex<Scalar>, kMaxBlockSamples / kSegmentSamples> segments_{};
};

}  // namespace tricoil::signal

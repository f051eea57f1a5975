// Couplings from samples in integers: the lock-in of signal::lock_in and the division by the reference current.
#pragma once

#include <array>
#include <span>

#include "core/base/status.hpp"
#include "core/fixed/block_matrix.hpp"
#include "core/signal/oscillator.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::fixed {

/// Reference oscillator exp(-i w n): exact at the start of each segment, by recurrence within it. Error below 8e-8.
class Oscillator {
public:
    Oscillator() = default;
    /// `cycles` whole cycles in `window_samples` samples; 0 < cycles < window_samples <= kMaxBlockSamples. Values outside this
    /// range are clamped.
    Oscillator(int cycles, int window_samples);

    [[nodiscard]] SineCosine step() const { return step_; }
    [[nodiscard]] SineCosine at_segment(std::size_t segment) const { return segments_[segment]; }

private:
    SineCosine step_;
    std::array<SineCosine, kMaxBlockSamples / signal::kSegmentSamples> segments_{};
};

/// Sum of x[n] exp(-i w n) in codes times 2^30: half the window length times the amplitude.
struct Phasor {
    std::int64_t re = 0;
    std::int64_t im = 0;
};

/// Samples of a converter with at most 24 bits; larger values are clamped. A sum over 1024 samples then stays below 2^64 / pi <
/// 2^63: exact except for the oscillator's rounding. Only the first kMaxBlockSamples samples are read.
std::array<Phasor, kChannels> lock_in(const Oscillator& oscillator, std::span<const Sample> window);

/// Couplings of one column: mantissa 2^exponent.
struct BlockColumn {
    Vec3<std::int32_t> in_phase = Vec3<std::int32_t>::Zero();
    Vec3<std::int32_t> quadrature = Vec3<std::int32_t>::Zero();
    int exponent = 0;
};

/// Sensor channels divided by the reference channel. Error below 2^-24 of the largest entry: quotients have three fraction bits.
/// Errors: degenerate (no reference: its amplitude is below least_reference codes).
Result<BlockColumn> couplings(const std::array<Phasor, kChannels>& phasors, std::size_t window_samples,
                              std::int32_t least_reference);

/// Signal matrix of three columns, with the largest of their exponents.
BlockMatrix assemble(const std::array<BlockColumn, 3>& columns);

}  // namespace tricoil::fixed

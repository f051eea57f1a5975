#include "core/fixed/demodulator.hpp"

#include <algorithm>

#include "core/fixed/sizes.hpp"

namespace tricoil::fixed {
namespace {

// Limits the sum of 1024 samples at constant phase to 2^63 - 2^40. The difference to 2^63 allows for the oscillator's magnitude.
constexpr std::int32_t kLargestCode = kFullScaleCode - 1;

/// exp(-i w n).
SineCosine phasor(int cycles, int window_samples, std::size_t n) {
    const auto window = static_cast<std::uint64_t>(window_samples);
    const std::uint64_t part = n * static_cast<std::uint64_t>(cycles) % window;
    const auto turns = static_cast<std::uint32_t>(((part << 32) + window / 2) / window);
    return sine_cosine({0U - turns});
}

/// a b, rounded once per part. Magnitudes stay below 1 + 32 * 2^-30 over a segment.
SineCosine turned(const SineCosine& a, const SineCosine& b) {
    const auto wide = [](Unit x, Unit y) { return std::int64_t{x.raw()} * y.raw(); };
    const std::int64_t cosine = wide(a.cosine, b.cosine) - wide(a.sine, b.sine);
    const std::int64_t sine = wide(a.cosine, b.sine) + wide(a.sine, b.cosine);
    return {Unit::from_raw(static_cast<std::int32_t>(shift_right_rounded(sine, 30))),
            Unit::from_raw(static_cast<std::int32_t>(shift_right_rounded(cosine, 30)))};
}

}  // namespace

Oscillator::Oscillator(int cycles, int window_samples) {
    window_samples = std::clamp(window_samples, 1, kMaxBlockSamples);
    cycles = std::clamp(cycles, 0, window_samples);
    step_ = phasor(cycles, window_samples, 1);
    for (std::size_t segment = 0; segment < segments_.size(); ++segment) {
        segments_[segment] = phasor(cycles, window_samples, segment * signal::kSegmentSamples);
    }
}

std::array<Phasor, kChannels> lock_in(const Oscillator& oscillator, std::span<const Sample> window) {
    // Per segment: first the reference, then each channel, so that its two 64-bit sums stay in registers.
    window = window.first(std::min<std::size_t>(window.size(), kMaxBlockSamples));
    std::array<SineCosine, signal::kSegmentSamples> reference;
    std::array<Phasor, kChannels> sums{};
    for (std::size_t begin = 0, segment = 0; begin < window.size(); begin += signal::kSegmentSamples, ++segment) {
        const std::size_t length = std::min<std::size_t>(signal::kSegmentSamples, window.size() - begin);
        SineCosine next = oscillator.at_segment(segment);
        for (std::size_t n = 0; n < length; ++n) {
            reference[n] = next;
            next = turned(next, oscillator.step());
        }
        for (std::size_t channel = 0; channel < kChannels; ++channel) {
            Phasor sum = sums[channel];
            for (std::size_t n = 0; n < length; ++n) {
                const std::int64_t code = std::clamp(window[begin + n][channel], -kLargestCode, kLargestCode);
                sum.re += code * reference[n].cosine.raw();
                sum.im += code * reference[n].sine.raw();
            }
            sums[channel] = sum;
        }
    }
    return sums;
}

Result<BlockColumn> couplings(const std::array<Phasor, kChannels>& phasors, std::size_t window_samples,
                              std::int32_t least_reference) {
    const Phasor& reference = phasors[kReferenceChannel];
    const std::uint64_t reference_size = size_of(reference.re) | size_of(reference.im);
    // For amplitude a the sum has the magnitude (a N / 2) * 2^30.
    window_samples = std::clamp<std::size_t>(window_samples, 1, kMaxBlockSamples);
    const auto least_code = static_cast<std::uint64_t>(std::clamp<std::int32_t>(least_reference, 1, kLargestCode));
    const std::uint64_t least = (least_code * window_samples) << 28;  // at most 2^23 * 2^10 * 2^28
    if (std::max(size_of(reference.re), size_of(reference.im)) < least) {
        return Status{StatusCode::degenerate, "no reference current"};
    }
    std::uint64_t all = 1;
    for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
        all |= size_of(phasors[coil].re) | size_of(phasors[coil].im);
    }
    // Scaled to 30 bits with a common shift.
    const int reference_shift = excess_bits(reference_size, 30);
    const int shift = excess_bits(all, 30);
    const std::int64_t re = scaled_down(reference.re, reference_shift);
    const std::int64_t im = scaled_down(reference.im, reference_shift);
    // |r|^2 is between 2^58 and 2^61, numerators are below 2^61. Their ratio is below 8 and has three fraction bits.
    const Quotients over_power(re * re + im * im);
    BlockColumn column;
    column.exponent = shift - reference_shift + 3 - 30;
    for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
        const std::int64_t a = scaled_down(phasors[coil].re, shift);
        const std::int64_t b = scaled_down(phasors[coil].im, shift);
        const auto i = static_cast<Index>(coil);
        column.in_phase(i) = over_power.of(shift_right_rounded(a * re + b * im, 3)).raw();
        column.quadrature(i) = over_power.of(shift_right_rounded(b * re - a * im, 3)).raw();
    }
    return column;
}

BlockMatrix assemble(const std::array<BlockColumn, 3>& columns) {
    BlockMatrix x;
    x.exponent = bounded_exponent(std::max({columns[0].exponent, columns[1].exponent, columns[2].exponent}));
    for (std::size_t j = 0; j < 3; ++j) {
        const int shift = std::min(x.exponent - bounded_exponent(columns[j].exponent), 62);
        for (Index i = 0; i < 3; ++i) {
            x.mantissa(i, static_cast<Index>(j)) = static_cast<std::int32_t>(shift_right_rounded(columns[j].in_phase(i), shift));
        }
    }
    return x;
}

}  // namespace tricoil::fixed

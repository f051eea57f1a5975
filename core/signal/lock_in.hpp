// Quadrature lock-in: amplitude and phase of one carrier in four channels over a window of whole cycles.
#pragma once

#include <array>
#include <complex>
#include <span>

#include "core/signal/oscillator.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::signal {

/// Complex amplitudes per channel, in codes: a channel 'a cos(w n + p)' gives a exp(i p), n counted from the window's first
/// sample.
template <typename Scalar>
using ChannelPhasors = std::array<std::complex<Scalar>, kChannels>;

/// Sum of x[n] exp(-i w n), times 2/N. Whole cycles make a constant offset and the other FDM carriers vanish exactly.
template <typename Scalar>
ChannelPhasors<Scalar> lock_in(const Oscillator<Scalar>& oscillator, std::span<const Sample> window);

/// What mains hum adds to lock_in(), and is to be taken from it: over a short window hum is a slope, and a slope is no whole
/// number of cycles. lock_in of the samples' differences would not see it; it equals lock_in less (x[-1] - x[N-1]) / (1 - exp(-i
/// w)) times 2/N, and from one end of the window to the other every carrier has come round, so that difference is the hum's
/// alone. Costs 2 % of noise; suppresses hum by the ratio of carrier to mains frequency. before: the sample before the window.
template <typename Scalar>
ChannelPhasors<Scalar> hum_leakage(const Oscillator<Scalar>& oscillator, const Sample& before, std::span<const Sample> window);

extern template ChannelPhasors<float> lock_in(const Oscillator<float>&, std::span<const Sample>);
extern template ChannelPhasors<double> lock_in(const Oscillator<double>&, std::span<const Sample>);
extern template ChannelPhasors<float> hum_leakage(const Oscillator<float>&, const Sample&, std::span<const Sample>);
extern template ChannelPhasors<double> hum_leakage(const Oscillator<double>&, const Sample&, std::span<const Sample>);

}  // namespace tricoil::signal

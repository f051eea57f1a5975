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

/// What mains hum adds to one carrier's lock_in(), per channel, to be taken from it. Over a short window hum is a slope, and a
/// slope is no whole number of cycles. The transform of the samples' differences would not see it; that transform equals
/// lock_in() less step / (1 - exp(-i w)) times 2/N, where step is what the hum falls by from one window's start to the next
/// one's. Costs 2 % of noise; suppresses hum by the ratio of carrier to mains frequency.
template <typename Scalar>
ChannelPhasors<Scalar> hum_leakage(const Oscillator<Scalar>& oscillator, const std::array<Scalar, kChannels>& step,
                                   std::size_t window_samples);

/// The fall of what is left in the window once the carriers, as lock_in() read them, are taken away: ends of the window compared.
template <typename Scalar>
std::array<Scalar, kChannels> hum_step(std::span<const Oscillator<Scalar>> oscillators,
                                       std::span<const ChannelPhasors<Scalar>> carriers, std::span<const Sample> window);

extern template ChannelPhasors<float> lock_in(const Oscillator<float>&, std::span<const Sample>);
extern template ChannelPhasors<double> lock_in(const Oscillator<double>&, std::span<const Sample>);
extern template ChannelPhasors<float> hum_leakage(const Oscillator<float>&, const std::array<float, kChannels>&, std::size_t);
extern template ChannelPhasors<double> hum_leakage(const Oscillator<double>&, const std::array<double, kChannels>&, std::size_t);
extern template std::array<float, kChannels> hum_step(std::span<const Oscillator<float>>, std::span<const ChannelPhasors<float>>,
                                                      std::span<const Sample>);
extern template std::array<double, kChannels> hum_step(std::span<const Oscillator<double>>,
                                                       std::span<const ChannelPhasors<double>>, std::span<const Sample>);

}  // namespace tricoil::signal

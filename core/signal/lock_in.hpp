// Quadrature lock-in: amplitude and phase of one carrier in four channels over a window of whole cycles.
#pragma once

#include <array>
#include <complex>
#include <span>

#include "core/signal/oscillator.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::signal {

/// Complex amplitudes per channel, in codes: a channel 'a cos(w n + p)' gives a exp(i p), with n = 0 at the first sample of the
/// window.
template <typename Scalar>
using ChannelPhasors = std::array<std::complex<Scalar>, kChannels>;

/// Sum of x[n] exp(-i w n), times 2/N. With whole cycles a constant offset and the other FDM carriers cancel exactly.
template <typename Scalar>
ChannelPhasors<Scalar> lock_in(const Oscillator<Scalar>& oscillator, std::span<const Sample> window);

/// Contribution of mains hum to lock_in() of one carrier, per channel, to be subtracted. Within a short window hum is
/// approximately a slope, which does not cancel. The transform of the differences of samples contains no slope; it equals
/// lock_in() minus step / (1 - exp(-i w)) times 2/N, where step is the decrease of the hum over one window. This increases
/// noise by 2 % at 10 kHz and suppresses hum by the ratio of carrier to mains frequency.
template <typename Scalar>
ChannelPhasors<Scalar> hum_leakage(const Oscillator<Scalar>& oscillator, const std::array<Scalar, kChannels>& step,
                                   std::size_t window_samples);

/// Decrease of the hum over the window: difference of the window's ends, without the carriers found by lock_in().
template <typename Scalar>
std::array<Scalar, kChannels> hum_step(std::span<const Oscillator<Scalar>> oscillators,
                                       std::span<const ChannelPhasors<Scalar>> carriers, std::span<const Sample> window);

}  // namespace tricoil::signal

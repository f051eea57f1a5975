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

extern template ChannelPhasors<float> lock_in(const Oscillator<float>&, std::span<const Sample>);
extern template ChannelPhasors<double> lock_in(const Oscillator<double>&, std::span<const Sample>);

}  // namespace tricoil::signal

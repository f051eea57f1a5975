#include "core/signal/lock_in.hpp"

#include <algorithm>

#include "core/base/precision.hpp"
#include "core/signal/complex_division.hpp"

namespace tricoil::signal {
namespace {

/// In-phase and quadrature sums of the four channels, as plain arrays that the compiler keeps in registers.
template <typename Scalar>
struct Sums {
    std::array<Scalar, kChannels> re{};
    std::array<Scalar, kChannels> im{};
};

/// Sums over one segment. Adding segments instead of samples also reduces rounding errors of long float sums.
template <typename Scalar>
Sums<Scalar> sum_segment(std::complex<Scalar> start, std::complex<Scalar> step, std::span<const Sample> segment) {
    Sums<Scalar> sums;
    Scalar c = start.real();
    Scalar s = start.imag();
    const Scalar step_c = step.real();
    const Scalar step_s = step.imag();
    for (const Sample& sample : segment) {
        for (std::size_t channel = 0; channel < kChannels; ++channel) {
            const auto value = static_cast<Scalar>(sample[channel]);
            sums.re[channel] += value * c;
            sums.im[channel] += value * s;
        }
        const Scalar next_c = c * step_c - s * step_s;
        s = c * step_s + s * step_c;
        c = next_c;
    }
    return sums;
}

}  // namespace

template <typename Scalar>
ChannelPhasors<Scalar> lock_in(const Oscillator<Scalar>& oscillator, std::span<const Sample> window) {
    Sums<Scalar> total;
    for (std::size_t begin = 0, segment = 0; begin < window.size(); begin += kSegmentSamples, ++segment) {
        const std::size_t length = std::min<std::size_t>(kSegmentSamples, window.size() - begin);
        const auto sums =
            sum_segment(oscillator.at_segment(static_cast<int>(segment)), oscillator.step(), window.subspan(begin, length));
        for (std::size_t channel = 0; channel < kChannels; ++channel) {
            total.re[channel] += sums.re[channel];
            total.im[channel] += sums.im[channel];
        }
    }
    const Scalar scale = Scalar(2) / static_cast<Scalar>(window.size());
    ChannelPhasors<Scalar> phasors;
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
        phasors[channel] = {scale * total.re[channel], scale * total.im[channel]};
    }
    return phasors;
}

template <typename Scalar>
ChannelPhasors<Scalar> hum_leakage(const Oscillator<Scalar>& oscillator, const std::array<Scalar, kChannels>& step,
                                   std::size_t window_samples) {
    // With e = exp(-i w) and whole cycles, differences y[n] = x[n] - x[n-1] have the transform (1 - e) X - (x[-1] - x[N-1]).
    const std::complex<Scalar> factor = divide(std::complex<Scalar>(Scalar(2) / static_cast<Scalar>(window_samples)),
                                               std::complex<Scalar>(1) - oscillator.step());
    ChannelPhasors<Scalar> leakage;
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
        leakage[channel] = factor * step[channel];
    }
    return leakage;
}

template <typename Scalar>
std::array<Scalar, kChannels> hum_step(std::span<const Oscillator<Scalar>> oscillators,
                                       std::span<const ChannelPhasors<Scalar>> carriers, std::span<const Sample> window) {
    const auto samples = static_cast<Scalar>(window.size());
    std::array<Scalar, kChannels> step{};
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
        auto first = static_cast<Scalar>(window.front()[channel]);
        auto last = static_cast<Scalar>(window.back()[channel]);
        for (std::size_t j = 0; j < carriers.size(); ++j) {
            first -= carriers[j][channel].real();
            last -= multiply(carriers[j][channel], oscillators[j].step()).real();  // exp(i w (N - 1)) = exp(-i w)
        }
        // Window ends are N - 1 samples apart, not N. Each measured carrier contains the leakage of the hum, which reduces the
        // step by 2/N.
        step[channel] = (first - last) * samples / (samples - 1 - 2 * static_cast<Scalar>(carriers.size()));
    }
    return step;
}

template ChannelPhasors<float> lock_in(const Oscillator<float>&, std::span<const Sample>);
template ChannelPhasors<float> hum_leakage(const Oscillator<float>&, const std::array<float, kChannels>&, std::size_t);
template std::array<float, kChannels> hum_step(std::span<const Oscillator<float>>, std::span<const ChannelPhasors<float>>,
                                               std::span<const Sample>);
#if TRICOIL_SCALARS & 2  // double
template ChannelPhasors<double> lock_in(const Oscillator<double>&, std::span<const Sample>);
template ChannelPhasors<double> hum_leakage(const Oscillator<double>&, const std::array<double, kChannels>&, std::size_t);
template std::array<double, kChannels> hum_step(std::span<const Oscillator<double>>, std::span<const ChannelPhasors<double>>,
                                                std::span<const Sample>);
#endif

}  // namespace tricoil::signal

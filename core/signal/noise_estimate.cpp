#include "core/signal/noise_estimate.hpp"

#include <cmath>

#include "core/base/precision.hpp"
#include "core/signal/unit_phasor.hpp"

namespace tricoil::signal {
namespace {

constexpr int kStride = 2;  // outputs overlap strongly: every second one has nearly all of the information

}  // namespace

template <typename Scalar>
NoiseEstimator<Scalar>::NoiseEstimator(const AcquisitionPlan& plan) {
    std::array<double, kMaxTaps> taps{1.0, -1.0};
    std::size_t count = 2;
    for (std::size_t j = 0; j < static_cast<std::size_t>(plan.carriers()); ++j) {
        const double c = -2 * unit_phasor(static_cast<double>(plan.window_cycles[j]) / plan.window_samples).real();
        std::array<double, kMaxTaps> product{};
        for (std::size_t n = 0; n < count; ++n) {
            product[n] += taps[n];
            product[n + 1] += c * taps[n];
            product[n + 2] += taps[n];
        }
        taps = product;
        count += 2;
    }
    double gain = 0;
    for (std::size_t n = 0; n < count; ++n) {
        taps_[n] = static_cast<Scalar>(taps[n]);
        gain += taps[n] * taps[n];
    }
    tap_count_ = static_cast<int>(count);
    noise_gain_ = static_cast<Scalar>(gain);
}

template <typename Scalar>
std::array<Scalar, kChannels> NoiseEstimator<Scalar>::sample_sigma(std::span<const Sample> window) const {
    std::array<Scalar, kChannels> power{};
    const auto taps = static_cast<std::size_t>(tap_count_);
    int outputs = 0;
    for (std::size_t n = 0; n + taps <= window.size(); n += kStride, ++outputs) {
        std::array<Scalar, kChannels> output{};
        for (std::size_t t = 0; t < taps; ++t) {
            for (std::size_t channel = 0; channel < kChannels; ++channel) {
                output[channel] += taps_[t] * static_cast<Scalar>(window[n + t][channel]);
            }
        }
        for (std::size_t channel = 0; channel < kChannels; ++channel) {
            power[channel] += output[channel] * output[channel];
        }
    }
    for (Scalar& value : power) {
        value = outputs > 0 ? std::sqrt(value / (static_cast<Scalar>(outputs) * noise_gain_)) : Scalar(0);
    }
    return power;
}

template class NoiseEstimator<float>;
#if TRICOIL_SCALARS & 2  // double
template class NoiseEstimator<double>;
#endif

}  // namespace tricoil::signal

#include "core/fixed/noise_estimate.hpp"

#include "core/fixed/functions.hpp"
#include "core/fixed/sizes.hpp"

namespace tricoil::fixed {
namespace {

constexpr std::size_t kStride = 2;  // as in signal::NoiseEstimator: every second output has nearly all of the information
constexpr int kTapBits = 25;
constexpr int kOutputBits = 4;  // outputs in units of 1/16 code
constexpr std::int64_t kMaxOutput = std::int64_t{1} << (19 + kOutputBits);

}  // namespace

NoiseEstimator::NoiseEstimator(const Acquisition& acquisition) {
    // In Q26 until the end: intermediate coefficients are at most 35, products with c < 2 in Q30 stay below 2^63.
    std::array<std::int64_t, kMaxTaps> taps{std::int64_t{1} << (kTapBits + 1), -(std::int64_t{1} << (kTapBits + 1))};
    std::size_t count = 2;
    for (std::size_t j = 0; j < acquisition.carriers(); ++j) {
        const auto cycles = static_cast<std::uint64_t>(acquisition.window_cycles[j]);
        const auto turns = static_cast<std::uint32_t>((cycles << 32) / static_cast<std::uint64_t>(acquisition.window_samples()));
        const std::int64_t cosine = sine_cosine({turns}).cosine.raw();
        std::array<std::int64_t, kMaxTaps> next{};
        for (std::size_t n = 0; n < count; ++n) {
            next[n] += taps[n];
            next[n + 1] -= shift_right_rounded(taps[n] * cosine, 29);
            next[n + 2] += taps[n];
        }
        taps = next;
        count += 2;
    }
    std::int64_t gain = 0;  // Q50: at most 128 * 35 * 2^50, below 2^63
    for (std::size_t n = 0; n < count; ++n) {
        taps_[n] = saturate(shift_right_rounded(taps[n], 1));
        gain += std::int64_t{taps_[n]} * taps_[n];
    }
    tap_count_ = count;
    gain_q8_ = std::max<std::int64_t>(gain >> (2 * kTapBits - 8), 1);
}

SampleVariances NoiseEstimator::sample_variance(std::span<const Sample> window) const {
    SampleVariances variances;
    variances.fill(kQuantisationQ16);
    if (window.size() < tap_count_) {
        return variances;
    }
    const std::size_t outputs = (window.size() - tap_count_) / kStride + 1;
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
        std::int64_t power = 0;  // outputs times 2^46 at most: below 2^56
        for (std::size_t n = 0; n + tap_count_ <= window.size(); n += kStride) {
            std::int64_t output = 0;  // codes of 24 bits times 128 in Q25: below 2^55
            for (std::size_t t = 0; t < tap_count_; ++t) {
                output +=
                    std::int64_t{taps_[t]} * std::clamp<std::int64_t>(window[n + t][channel], -kFullScaleCode, kFullScaleCode);
            }
            const std::int64_t kept = std::clamp(shift_right_rounded(output, kTapBits - kOutputBits), -kMaxOutput, kMaxOutput);
            power += kept * kept;
        }
        // The mean is at most 2^46 in Q8. 2^16 times the mean, divided by the gain in Q8, is in Q16.
        const std::int64_t mean_q8 = power / static_cast<std::int64_t>(outputs);
        variances[channel] = std::max(mean_q8 * (1 << 16) / gain_q8_, kQuantisationQ16);
    }
    return variances;
}

}  // namespace tricoil::fixed

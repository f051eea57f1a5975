#include "core/fixed/hum.hpp"

#include <algorithm>

#include "core/fixed/sizes.hpp"

namespace tricoil::fixed {
namespace {

constexpr std::int64_t kMaxStep = kFullScaleCode << 8;  // full scale, Q8

}  // namespace

HumStep hum_step(std::span<const Oscillator> oscillators, std::span<const std::array<Phasor, kChannels>> carriers,
                 std::span<const Sample> window) {
    const auto samples = static_cast<std::int64_t>(window.size());
    const std::int64_t per_sample = (std::int64_t{1} << 31) / samples;
    // A sum of codes times 2^30, at most 2^23 * N * 2^30, converted to an amplitude in Q8 by 2 / N: below 2^24 * 2^31 before the
    // shift.
    const auto amplitude = [per_sample](std::int64_t sum) { return shift_right_rounded((sum >> 30) * per_sample, 22); };
    const std::int64_t between = samples - 1 - 2 * static_cast<std::int64_t>(carriers.size());
    HumStep step{};
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
        const auto code = [channel](const Sample& sample) {
            return std::clamp<std::int64_t>(sample[channel], -kFullScaleCode, kFullScaleCode) * (1 << 8);
        };
        std::int64_t first = code(window.front());
        std::int64_t last = code(window.back());
        for (std::size_t j = 0; j < carriers.size(); ++j) {
            const std::int64_t re = amplitude(carriers[j][channel].re);
            const std::int64_t im = amplitude(carriers[j][channel].im);
            const SineCosine turn = oscillators[j].step();  // exp(i w (N - 1)) = exp(-i w)
            first -= re;
            last -= shift_right_rounded(re * turn.cosine.raw() - im * turn.sine.raw(), 30);  // 2^33 * 2^30
        }
        step[channel] = std::clamp((first - last) * samples / between, -kMaxStep, kMaxStep);
    }
    return step;
}

void remove_hum(const Oscillator& oscillator, const HumStep& step, std::array<Phasor, kChannels>& carrier) {
    // 1 / (1 - e) with e = c + i s is (1 - c + i s) / (2 (1 - c)) = 1/2 + i s / (2 (1 - c)); |s / (1 - c)| <= 326 for one cycle
    // in 1024 samples: half of it in Q20 below 2^28. Steps in Q8 are at most 2^31, so four times the product stays below 2^61.
    constexpr std::int64_t kOne = std::int64_t{1} << 30;
    const SineCosine e = oscillator.step();
    const std::int64_t gap = std::max<std::int64_t>(kOne - e.cosine.raw(), 1);
    const std::int64_t slope = std::clamp<std::int64_t>(e.sine.raw() * (std::int64_t{1} << 19) / gap, -(1 << 28), 1 << 28);
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
        carrier[channel].re -= step[channel] * (1 << 21);
        carrier[channel].im -= step[channel] * slope * 4;
    }
}

}  // namespace tricoil::fixed

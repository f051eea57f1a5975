#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/selfcheck/checks.hpp"
#include "core/selfcheck/known_answer.hpp"
#include "core/signal/lock_in.hpp"

namespace tricoil::selfcheck {
namespace {

constexpr int kSamples = 64;
constexpr int kCycles = 5;
constexpr double kAmplitude = 4e6;                                   // codes, of a 24-bit converter
constexpr std::array<double, kChannels> kPhases{0.3, -1.2, 2.5, 0};  // rad
constexpr double kOffset = 2e5;                                      // codes; whole cycles must not see it

std::array<Sample, kSamples> tone() {
    std::array<Sample, kSamples> samples{};
    for (int n = 0; n < kSamples; ++n) {
        const double angle = 2 * std::numbers::pi * kCycles * n / kSamples;
        for (std::size_t channel = 0; channel < kChannels; ++channel) {
            const double amplitude = kAmplitude / static_cast<double>(channel + 1);
            samples[static_cast<std::size_t>(n)][channel] =
                static_cast<std::int32_t>(std::lround(kOffset + amplitude * std::cos(angle + kPhases[channel])));
        }
    }
    return samples;
}

}  // namespace

template <typename Scalar>
void check_demodulator(Report& report) {
    const auto samples = tone();
    const auto phasors = signal::lock_in(signal::Oscillator<Scalar>(kCycles, kSamples), std::span<const Sample>(samples));
    double worst = 0;
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
        const double amplitude = kAmplitude / static_cast<double>(channel + 1);
        const double in_phase = static_cast<double>(phasors[channel].real()) - amplitude * std::cos(kPhases[channel]);
        const double quadrature = static_cast<double>(phasors[channel].imag()) - amplitude * std::sin(kPhases[channel]);
        worst = std::max(worst, std::hypot(in_phase, quadrature));
    }
    // Codes are whole: a rounding of half a code in each of 64 samples, plus what the scalar type rounds.
    report.add(CheckId::demodulator_tone, precision_of<Scalar>(), "demodulated tone (codes)", worst,
               0.5 + kAmplitude * roundings<Scalar>(16));
}

template void check_demodulator<float>(Report&);
template void check_demodulator<double>(Report&);

}  // namespace tricoil::selfcheck

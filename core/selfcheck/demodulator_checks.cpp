#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/precision.hpp"
#include "core/selfcheck/checks.hpp"
#include "core/selfcheck/known_answer.hpp"
#include "core/signal/complex_division.hpp"
#include "core/signal/lock_in.hpp"

namespace tricoil::selfcheck {
namespace {

constexpr int kSamples = 40;  // more than a segment of the oscillator; 640 bytes of stack
constexpr int kCycles = 5;
constexpr double kAmplitude = 4e6;                                   // codes, of a 24-bit converter
constexpr std::array<double, kChannels> kPhases{0.05, 0.8, 0.4, 0};  // of a turn, as in unit_phasor()
constexpr double kOffset = 2e5;                                      // codes; whole cycles cancel it

void fill_with_tone(std::array<Sample, kSamples>& samples) {
    for (int n = 0; n < kSamples; ++n) {
        const auto tone = signal::unit_phasor(static_cast<double>(kCycles * n % kSamples) / kSamples);
        for (std::size_t channel = 0; channel < kChannels; ++channel) {
            const double amplitude = kAmplitude / static_cast<double>(channel + 1);
            const double real = signal::multiply(tone, signal::unit_phasor(kPhases[channel])).real();
            samples[static_cast<std::size_t>(n)][channel] = static_cast<std::int32_t>(std::lround(kOffset + amplitude * real));
        }
    }
}

}  // namespace

template <typename Scalar>
void check_demodulator(Report& report) {
    std::array<Sample, kSamples> samples{};
    fill_with_tone(samples);
    const auto phasors = signal::lock_in(signal::Oscillator<Scalar>(kCycles, kSamples), std::span<const Sample>(samples));
    double worst = 0;
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
        const double amplitude = kAmplitude / static_cast<double>(channel + 1);
        const auto answer = std::conj(signal::unit_phasor(kPhases[channel]));
        const double in_phase = std::abs(static_cast<double>(phasors[channel].real()) - amplitude * answer.real());
        const double quadrature = std::abs(static_cast<double>(phasors[channel].imag()) - amplitude * answer.imag());
        worst = std::max({worst, in_phase, quadrature});
    }
    // Limit: rounding of each sample to a whole code, plus rounding of the scalar type.
    report.add(CheckId::demodulator_tone, precision_of<Scalar>(), "demodulated tone (codes)", worst,
               0.5 + kAmplitude * roundings<Scalar>(16));
}

template void check_demodulator<float>(Report&);
#if TRICOIL_SCALARS & 2  // double
template void check_demodulator<double>(Report&);
#endif

}  // namespace tricoil::selfcheck

// Blocks of known tones, for tests of the demodulator.
#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "core/signal/acquisition_plan.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::test {

struct Tone {
    double amplitude;  // codes
    double phase_rad = 0;
};

/// Each channel: one tone per carrier, an offset, white noise and hum, in codes.
struct ToneBlock {
    std::array<std::array<Tone, kMaxCarriers>, kChannels> tones{};
    std::array<double, kChannels> offset{};
    double noise = 0;
    double hum = 0;  // amplitude, 50 Hz
};

/// Samples of a block that begins at sample `first` of the stream. The carriers continue from block to block.
inline std::vector<Sample> render(const ToneBlock& block, const signal::AcquisitionPlan& plan, std::mt19937_64& random,
                                  long first = 0) {
    std::normal_distribution<double> normal(0, 1);
    std::vector<Sample> samples(static_cast<std::size_t>(plan.block_samples));
    for (int n = 0; n < plan.block_samples; ++n) {
        const double t = static_cast<double>(first + n) / plan.params.sample_rate_hz;
        for (std::size_t c = 0; c < kChannels; ++c) {
            double value =
                block.offset[c] + block.hum * std::sin(2 * std::numbers::pi * 50 * t + 0.4) + block.noise * normal(random);
            for (std::size_t j = 0; j < kMaxCarriers; ++j) {
                const Tone& tone = block.tones[c][j];
                value += tone.amplitude * std::cos(2 * std::numbers::pi * plan.params.carrier_hz[j] * t + tone.phase_rad);
            }
            samples[static_cast<std::size_t>(n)][c] = static_cast<std::int32_t>(std::lround(value));
        }
    }
    return samples;
}

}  // namespace tricoil::test

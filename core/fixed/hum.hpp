// What mains hum adds to a lock-in, in integers: signal::hum_step and signal::hum_leakage.
#pragma once

#include <array>
#include <span>

#include "core/fixed/demodulator.hpp"

namespace tricoil::fixed {

/// Per channel: what the hum falls by over one window, in codes times 2^8.
using HumStep = std::array<std::int64_t, kChannels>;

/// From the ends of the window less the carriers as lock_in() read them. Windows of 16 to kMaxBlockSamples samples.
HumStep hum_step(std::span<const Oscillator> oscillators, std::span<const std::array<Phasor, kChannels>> carriers,
                 std::span<const Sample> window);

/// Takes the hum's leakage, step / (1 - exp(-i w)), from the sums of one carrier.
void remove_hum(const Oscillator& oscillator, const HumStep& step, std::array<Phasor, kChannels>& carrier);

}  // namespace tricoil::fixed

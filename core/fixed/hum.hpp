// Removal of mains hum from lock-in results, in integers. Twin of signal::hum_step and signal::hum_leakage.
#pragma once

#include <array>
#include <span>

#include "core/fixed/demodulator.hpp"

namespace tricoil::fixed {

/// Per channel: decrease of the hum over one window, in codes times 2^8.
using HumStep = std::array<std::int64_t, kChannels>;

/// Hum step from the ends of the window, without the carriers found by lock_in(). Windows of 16 to kMaxBlockSamples samples.
HumStep hum_step(std::span<const Oscillator> oscillators, std::span<const std::array<Phasor, kChannels>> carriers,
                 std::span<const Sample> window);

/// Subtracts the leakage of the hum, step / (1 - exp(-i w)), from the sums of one carrier.
void remove_hum(const Oscillator& oscillator, const HumStep& step, std::array<Phasor, kChannels>& carrier);

}  // namespace tricoil::fixed

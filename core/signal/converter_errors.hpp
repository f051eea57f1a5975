// Errors of the sensor channels' converters and gain steps, and their correction.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "core/signal/excitation.hpp"
#include "core/signal/gain_step.hpp"

namespace tricoil::signal {

/// Integral non-linearity of each sensor channel's converter, as jumps of its characteristic, and the remaining error of each
/// gain step after GainControl::measure(). The default is no error.
///
/// A successive-approximation converter adds the capacitors of its bits. A capacitor that is wrong shifts all codes in which its
/// bit is set, so the characteristic jumps where an upper bit changes: at multiples of 1/16 of full scale. A jump of height h at
/// the level x adds (2/pi) h sqrt(1 - (x/a)^2) to the amplitude of a sine of amplitude a > |x|, and nothing to a smaller one.
struct ConverterErrors {
    static constexpr std::size_t kJumps = 14;  // up to 13/16 of full scale; ranging keeps the signal below 0.85
    static constexpr float kSpacing = 1.0F / 16;
    static constexpr float kJumpUnit = 1.0F / (32 * 2048);  // of full scale: 1/32 of the least significant bit of twelve
    static constexpr float kGainUnit = 1.0F / 16384;        // relative

    std::array<std::array<std::int8_t, kJumps>, kSensorCoils> jump{};         // [coil][n]: at n kSpacing and -n kSpacing together
    std::array<std::array<std::int8_t, kSensorCoils>, kMaxGainSteps> gain{};  // [step][coil]: true gain / stated gain - 1

    /// Response of jump n to a sine: amplitude error for a jump of height 1. amplitude: share of full scale.
    static float response(std::size_t n, float amplitude) {
        const float level = static_cast<float>(n) * kSpacing;
        const float ratio = amplitude > level ? level / amplitude : 1.0F;
        return 2 / std::numbers::pi_v<float> * std::sqrt(1 - ratio * ratio);
    }

    /// Error of the measured amplitude of a single sine, share of full scale.
    [[nodiscard]] float amplitude_error(std::size_t coil, float amplitude) const {
        float sum = 0;
        for (std::size_t n = 0; n < kJumps; ++n) {
            sum += static_cast<float>(jump[coil][n]) * response(n, amplitude);
        }
        return kJumpUnit * sum;
    }

    [[nodiscard]] float gain_error(std::size_t step, std::size_t coil) const {
        return kGainUnit * static_cast<float>(gain[step][coil]);
    }

    /// Factor that corrects a phasor of this measured amplitude (share of full scale), sampled with this gain step. alone: the
    /// carrier is the only signal in the channel; the model does not hold for a sum of carriers, so that only the gain is
    /// corrected.
    [[nodiscard]] float correction(std::size_t step, std::size_t coil, float amplitude, bool alone) const {
        const float error = alone && amplitude > 0 ? amplitude_error(coil, amplitude) / amplitude : 0;
        return (1 - error) * (1 - gain_error(step, coil));
    }

    [[nodiscard]] bool operator==(const ConverterErrors&) const = default;
};

}  // namespace tricoil::signal

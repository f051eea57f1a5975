// Response of the sensor amplifiers for each gain step.
#pragma once

#include <array>
#include <complex>

#include "core/signal/excitation.hpp"

namespace tricoil::signal {

constexpr std::size_t kMaxGainSteps = 12;

/// Amplification of each sensor channel at one step, in addition to DemodulatorParams::response: gain / (1 + i w lag), because
/// the bandwidth of an amplifier falls as its gain rises. The default is no amplification.
template <typename Scalar>
struct GainStep {
    std::array<Scalar, kSensorCoils> gain{1, 1, 1};
    std::array<Scalar, kSensorCoils> lag_s{};
    Scalar noise = 1;  // power of the noise at the carriers relative to that of NoiseEstimator, which assumes white noise
    Scalar drive = 1;  // of the source, relative to full drive; division by the reference removes it from the couplings

    /// Response at an angular frequency, rad/s.
    [[nodiscard]] std::complex<Scalar> response(std::size_t coil, Scalar w_rad_s) const {
        const Scalar turn = w_rad_s * lag_s[coil];
        const Scalar scale = gain[coil] / (1 + turn * turn);
        return {scale, -scale * turn};
    }
};

template <typename Scalar>
using GainSteps = std::array<GainStep<Scalar>, kMaxGainSteps>;

}  // namespace tricoil::signal

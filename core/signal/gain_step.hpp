// Response of the sensor amplifiers for each gain step.
#pragma once

#include <array>
#include <complex>

#include "core/signal/excitation.hpp"

namespace tricoil::signal {

constexpr std::size_t kMaxGainSteps = 12;

/// Amplification of each sensor channel at one step, in addition to DemodulatorParams::response: gain / (1 + i w lag), because
/// the bandwidth of an amplifier falls as its gain rises. With a capacitor at the end of the feedback ladder the part of the gain
/// above 1 is a high-pass with time constant T: (1 + (gain - 1) i w T / (1 + i w T)) / (1 + i w lag). The default is no
/// amplification.
template <typename Scalar>
struct GainStep {
    std::array<Scalar, kSensorCoils> gain{1, 1, 1};
    std::array<Scalar, kSensorCoils> lag_s{};
    Scalar noise = 1;  // power of the noise at the carriers relative to that of NoiseEstimator, which assumes white noise
    Scalar drive = 1;  // of the source, relative to full drive; division by the reference removes it from the couplings

    /// Response at an angular frequency, rad/s. ladder_s: T; 0: no capacitor. At the high carriers it shifts
    /// the phase by 2 mrad.
    [[nodiscard]] std::complex<Scalar> response(std::size_t coil, Scalar w_rad_s, Scalar ladder_s = 0) const {
        const Scalar turn = w_rad_s * lag_s[coil];
        const Scalar scale = gain[coil] / (1 + turn * turn);
        if (ladder_s > 0) {
            const Scalar lead = 1 / (w_rad_s * ladder_s);
            const Scalar blocked = (gain[coil] - 1) * lead / (1 + lead * lead) / (1 + turn * turn);
            // (1 + (gain - 1) (1 + i lead) / (1 + lead^2)) (1 - i turn) / (1 + turn^2)
            return {scale + blocked * (turn - lead), -scale * turn + blocked * (1 + lead * turn)};
        }
        return {scale, -scale * turn};
    }
};

template <typename Scalar>
using GainSteps = std::array<GainStep<Scalar>, kMaxGainSteps>;

}  // namespace tricoil::signal

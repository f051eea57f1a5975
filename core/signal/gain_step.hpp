// What an amplifier with steps of gain does to the sensor channels, step by step.
#pragma once

#include <array>
#include <complex>

#include "core/signal/excitation.hpp"

namespace tricoil::signal {

constexpr std::size_t kMaxGainSteps = 8;

/// One step's amplification of each sensor channel, beyond what DemodulatorParams::response holds: gain / (1 + i w lag), an
/// amplifier whose bandwidth falls as its gain rises. As it is: none.
template <typename Scalar>
struct GainStep {
    std::array<Scalar, kSensorCoils> gain{1, 1, 1};
    std::array<Scalar, kSensorCoils> lag_s{};

    /// At an angular frequency, rad/s.
    [[nodiscard]] std::complex<Scalar> response(std::size_t coil, Scalar w_rad_s) const {
        const Scalar turn = w_rad_s * lag_s[coil];
        const Scalar scale = gain[coil] / (1 + turn * turn);
        return {scale, -scale * turn};
    }
};

template <typename Scalar>
using GainSteps = std::array<GainStep<Scalar>, kMaxGainSteps>;

}  // namespace tricoil::signal

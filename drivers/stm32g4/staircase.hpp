// Response of a one-pole amplifier to a carrier that a DAC plays in steps.
#pragma once

#include <cmath>
#include <complex>

#include "core/signal/complex_division.hpp"

namespace tricoil::stm32g4 {

/// Steps of length `edge_s`; the amplifier's output is sampled `sampled_s` after each step, at most one step length.
struct Staircase {
    float w_rad_s;  // of the carrier
    float edge_s;
    float sampled_s;

    /// Sampled response, relative to an amplifier without lag. After each step the output approaches the new value like exp(-t /
    /// lag). With T the step length and q = exp(-i w T): 1 - exp(-sampled/lag) (1 - q) / (1 - exp(-T/lag) q).
    [[nodiscard]] std::complex<float> response(float lag_s) const {
        const std::complex<float> q = std::polar(1.0F, -w_rad_s * edge_s);
        const float left = std::exp(-sampled_s / lag_s);  // remaining difference at the sampling time
        const float kept = std::exp(-edge_s / lag_s);
        return 1.0F - left * signal::divide(1.0F - q, 1.0F - kept * q);
    }

    /// The lag, at most `longest_s`, whose response has the phase of `seen`.
    [[nodiscard]] float lag_of(const std::complex<float>& seen, float longest_s) const {
        float least = 0;
        float most = longest_s;
        for (int n = 0; n < kHalvings; ++n) {
            const float middle = (least + most) / 2;
            const std::complex<float> r = response(middle);
            const bool is_later = r.imag() * seen.real() > seen.imag() * r.real();  // seen has more phase lag
            (is_later ? least : most) = middle;
        }
        return most;
    }

private:
    static constexpr int kHalvings = 16;
};

}  // namespace tricoil::stm32g4

// A demodulator's parameters for a board that computes in single precision.
#pragma once

#include <complex>

#include "core/signal/demodulator.hpp"

namespace tricoil::sim {

inline signal::DemodulatorParams<float> in_single(const signal::DemodulatorParams<double>& p) {
    signal::DemodulatorParams<float> single;
    for (std::size_t j = 0; j < p.response.size(); ++j) {
        for (std::size_t c = 0; c < kSensorCoils; ++c) {
            single.response[j][c] = static_cast<std::complex<float>>(p.response[j][c]);
        }
    }
    for (std::size_t n = 0; n < signal::kMaxGainSteps; ++n) {
        single.gain_steps[n].noise = static_cast<float>(p.gain_steps[n].noise);
        single.gain_steps[n].drive = static_cast<float>(p.gain_steps[n].drive);
        for (std::size_t c = 0; c < kSensorCoils; ++c) {
            single.gain_steps[n].gain[c] = static_cast<float>(p.gain_steps[n].gain[c]);
            single.gain_steps[n].lag_s[c] = static_cast<float>(p.gain_steps[n].lag_s[c]);
        }
    }
    single.ladder_s = static_cast<float>(p.ladder_s);
    single.sigma_floor = static_cast<float>(p.sigma_floor);
    single.linear_share = p.linear_share;
    return single;
}

}  // namespace tricoil::sim

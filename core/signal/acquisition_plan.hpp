// How the three couplings share the channel: rates, windows and carriers, validated once before anything is sampled.
#pragma once

#include <array>
#include <complex>

#include "core/base/status.hpp"
#include "core/signal/excitation.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::signal {

/// Time-division: one carrier, states S1, S2, S3 in turn. Frequency-division: three carriers at once.
enum class Multiplexing : std::uint8_t { tdm, fdm };

/// What a user sets. All frequencies in Hz.
struct AcquisitionParams {
    Multiplexing multiplexing = Multiplexing::tdm;
    double sample_rate_hz = 144e3;                  // per channel; 144 kS/s is the ADS1274's fastest 24-bit rate
    double frame_rate_hz = 240;                     // three columns per frame; the paper's 1/T
    std::array<double, kSourceCoils> carrier_hz{};  // per source coil; TDM uses the first for all
    int guard_samples = 0;                          // dropped at the head of each TDM slot while the coil current settles
};

/// What follows from valid parameters.
struct AcquisitionPlan {
    AcquisitionParams params;
    int block_samples = 0;                          // one TDM slot, or one FDM frame
    int window_samples = 0;                         // demodulated: block less guard
    std::array<int, kSourceCoils> window_cycles{};  // whole carrier cycles in the window

    [[nodiscard]] bool is_tdm() const { return params.multiplexing == Multiplexing::tdm; }
    [[nodiscard]] int carriers() const { return is_tdm() ? 1 : kSourceCoils; }
    [[nodiscard]] double window_s() const { return window_samples / params.sample_rate_hz; }
    [[nodiscard]] double block_s() const { return block_samples / params.sample_rate_hz; }
};

/// Carriers near 10 kHz (TDM) or near 7.7, 10 and 13.4 kHz (FDM; unevenly spaced, so that no third-order product of two falls on
/// the third), snapped to whole cycles per window; a guard of a fifth of a TDM slot. The result still has to be validated.
AcquisitionParams default_acquisition(Multiplexing multiplexing, double frame_rate_hz, double sample_rate_hz = 144e3);

/// Errors (invalid_argument, the message names the parameter): a rate not positive or not finite; blocks not of whole samples or
/// too long; guard not shorter than the block; carriers beyond 0.45 of the sample rate, not whole cycles per window, or closer
/// together than two cycles per window (FDM); fewer than four cycles per window, as in TDM at high frame rates.
Result<AcquisitionPlan> plan_acquisition(const AcquisitionParams& params);

}  // namespace tricoil::signal

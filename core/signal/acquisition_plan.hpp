// Acquisition plan: multiplexing, rates, windows and carriers, validated before sampling starts.
#pragma once

#include <array>
#include <span>

#include "core/base/status.hpp"
#include "core/signal/excitation.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::signal {

/// Time-division: one carrier, states S1, S2, S3 in turn. Frequency-division: three carriers at the same time. Dual-band:
/// frequency-division with a high and a low carrier for each source coil, all at the same time; metal acts differently on both
/// bands. The values are those of the wire protocol.
enum class Multiplexing : std::uint8_t { tdm, fdm, dual_band };

/// Settings of the user. All frequencies in Hz.
struct AcquisitionParams {
    Multiplexing multiplexing = Multiplexing::tdm;
    double sample_rate_hz = 144e3;  // per channel; 144 kS/s is the ADS1274's fastest 24-bit rate
    double frame_rate_hz = 240;     // three columns per frame; the paper's 1/T
    /// High band, then low band, each per source coil; TDM uses the first for all coils. Low band: zero unless dual-band.
    std::array<double, kMaxCarriers> carrier_hz{};
    int guard_samples = 0;  // dropped at the start of each TDM slot while the coil current settles
};

/// Quantities derived from valid parameters.
struct AcquisitionPlan {
    AcquisitionParams params;
    int block_samples = 0;                          // one TDM slot, or one FDM frame
    int window_samples = 0;                         // demodulated: block minus guard
    std::array<int, kMaxCarriers> window_cycles{};  // whole carrier cycles in the window

    [[nodiscard]] bool is_tdm() const { return params.multiplexing == Multiplexing::tdm; }
    [[nodiscard]] constexpr bool has_low_band() const { return params.multiplexing == Multiplexing::dual_band; }
    /// Carriers at the same time.
    [[nodiscard]] int carriers() const { return is_tdm() ? 1 : (has_low_band() ? kMaxCarriers : kSourceCoils); }
    /// Whole cycles of the high carriers in the window.
    [[nodiscard]] std::span<const int> high_cycles() const {
        return std::span(window_cycles).first(is_tdm() ? 1U : kSourceCoils);
    }
    [[nodiscard]] double window_s() const { return window_samples / params.sample_rate_hz; }
    [[nodiscard]] double block_s() const { return block_samples / params.sample_rate_hz; }
};

/// Carriers near 10 kHz (TDM) or near 7.7, 10 and 13.4 kHz (FDM; unevenly spaced, so that no third-order product of two carriers
/// has the frequency of the third), in the low band near 480, 720 and 960 Hz, rounded to whole cycles per window. The guard is a
/// fifth of a TDM slot. The result must still be validated.
AcquisitionParams default_acquisition(Multiplexing multiplexing, double frame_rate_hz, double sample_rate_hz = 144e3);

/// Errors (invalid_argument, the message names the parameter): a rate is not positive or not finite; a block is not a whole
/// number of samples or is too long; the guard is not shorter than the block; a carrier is above 0.45 of the sample rate, is not
/// a whole number of cycles per window, has fewer than four cycles per window (TDM at high frame rates), or is closer than two
/// cycles per window to another one (FDM). Low band: not dual-band; fewer than two cycles, or equal carriers; not below all high
/// carriers.
Result<AcquisitionPlan> plan_acquisition(const AcquisitionParams& params);

}  // namespace tricoil::signal

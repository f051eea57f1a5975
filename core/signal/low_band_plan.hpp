// Second band of low tones, transmitted at the same time as the carriers of an FDM plan.
#pragma once

#include <array>

#include "core/base/status.hpp"
#include "core/signal/acquisition_plan.hpp"

namespace tricoil::signal {

/// Eddy currents grow with frequency, so low tones show the field with less effect of metal. Their induced voltage is small, so
/// they are demodulated over a window of many blocks. Every low tone has whole cycles in a block: then it does not appear in the
/// carriers of the high band.
struct LowBandPlan {
    std::array<int, kSourceCoils> block_cycles{};  // cycles of each coil's tone in one block
    int block_samples = 0;
    double sample_rate_hz = 1;
    int window_blocks = 0;  // even

    /// Limits of the tones, and their nominal frequencies.
    static constexpr double kMin_hz = 300;
    static constexpr double kMax_hz = 1000;
    static constexpr std::array<double, kSourceCoils> kNominal_hz{480, 720, 960};
    /// The window is weighted as a Hann window (raised cosine). This length suppresses the 5th harmonic of 50 Hz mains, which is
    /// 230 Hz from the lowest tone, by 69 dB.
    static constexpr double kWindow_s = 1.0 / 24;
    static constexpr int kMaxWindowBlocks = 14;

    [[nodiscard]] double tone_hz(std::size_t coil) const { return block_cycles[coil] * sample_rate_hz / block_samples; }
    [[nodiscard]] double block_s() const { return block_samples / sample_rate_hz; }
    [[nodiscard]] double window_s() const { return window_blocks * block_s(); }
    /// Windows overlap by half.
    [[nodiscard]] int hop_blocks() const { return window_blocks / 2; }
};

/// Errors (invalid_argument): the plan is TDM; fewer than three multiples of its frame rate are within the limits of the tones.
Result<LowBandPlan> plan_low_band(const AcquisitionPlan& high);

}  // namespace tricoil::signal

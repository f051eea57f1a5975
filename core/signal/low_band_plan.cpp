#include "core/signal/low_band_plan.hpp"

#include <algorithm>
#include <cmath>

namespace tricoil::signal {

Result<LowBandPlan> plan_low_band(const AcquisitionPlan& high) {
    if (high.is_tdm()) {
        return Status{StatusCode::invalid_argument, "two bands need FDM: all coils transmit all the time"};
    }
    const double rate_hz = high.params.frame_rate_hz;
    constexpr double kTolerance = 1e-6;  // cycles
    const int least = std::max(1, static_cast<int>(std::ceil(LowBandPlan::kMin_hz / rate_hz - kTolerance)));
    const int most = static_cast<int>(std::floor(LowBandPlan::kMax_hz / rate_hz + kTolerance));
    if (most - least + 1 < kSourceCoils) {
        return Status{StatusCode::invalid_argument,
                      "two bands need three multiples of the frame rate between 300 and 1000 Hz: at most 333 frames per second"};
    }
    LowBandPlan plan;
    plan.block_samples = high.block_samples;
    plan.sample_rate_hz = high.params.sample_rate_hz;
    const int half_window = static_cast<int>(std::lround(LowBandPlan::kWindow_s * rate_hz / 2));
    plan.window_blocks = 2 * std::clamp(half_window, 2, LowBandPlan::kMaxWindowBlocks / 2);
    for (int j = 0; j < kSourceCoils; ++j) {
        const int nearest = static_cast<int>(std::lround(LowBandPlan::kNominal_hz[static_cast<std::size_t>(j)] / rate_hz));
        const int above = j == 0 ? least : plan.block_cycles[static_cast<std::size_t>(j - 1)] + 1;
        plan.block_cycles[static_cast<std::size_t>(j)] = std::clamp(nearest, above, most - (kSourceCoils - 1 - j));
    }
    return plan;
}

}  // namespace tricoil::signal

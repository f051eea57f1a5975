#include "core/signal/block_health.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tricoil::signal {
namespace {

constexpr float kNearPeak = 0.99F;
constexpr float kNearPeakWidth_rad = 0.28307857F;  // 2 acos(0.99): width of a cosine within 1 % of its peak
constexpr int kMinFlatTops = 3;                    // fewer may occur by chance
constexpr float kClearSignalCodes = 1000;          // below it, quantisation causes flat tops

struct ChannelRange {
    std::int32_t lowest = 0;
    std::int32_t highest = 0;
    float mean = 0;
};

ChannelRange measure(std::span<const Sample> window, std::size_t channel) {
    ChannelRange range{window.front()[channel], window.front()[channel], 0};
    std::int64_t sum = 0;
    for (const Sample& sample : window) {
        range.lowest = std::min(range.lowest, sample[channel]);
        range.highest = std::max(range.highest, sample[channel]);
        sum += sample[channel];
    }
    range.mean = static_cast<float>(sum) / static_cast<float>(window.size());
    return range;
}

/// Longest run of samples that a cosine of the slowest high carrier spends within 1 % of its peak, plus one for rounding of the
/// start. Low carriers are slower, but at a peak of the sum the high ones dominate the curvature.
int longest_natural_run(const AcquisitionPlan& plan) {
    const int high_carriers = std::min(plan.carriers(), kSourceCoils);
    const int cycles = *std::min_element(plan.window_cycles.begin(), plan.window_cycles.begin() + high_carriers);
    const float step_rad = 2 * std::numbers::pi_v<float> * static_cast<float>(cycles) / static_cast<float>(plan.window_samples);
    return static_cast<int>(kNearPeakWidth_rad / step_rad) + 2;
}

bool has_flat_tops(std::span<const Sample> window, std::size_t channel, const ChannelRange& range, int natural_run) {
    const float half_swing = 0.5F * (static_cast<float>(range.highest) - static_cast<float>(range.lowest));
    if (half_swing < kClearSignalCodes) {
        return false;
    }
    const float upper = static_cast<float>(range.highest) - (1 - kNearPeak) * half_swing;
    const float lower = static_cast<float>(range.lowest) + (1 - kNearPeak) * half_swing;
    int flat_tops = 0;
    int run = 0;
    int side = 0;
    for (const Sample& sample : window) {
        const auto value = static_cast<float>(sample[channel]);
        const int now = value >= upper ? 1 : (value <= lower ? -1 : 0);
        run = now == 0 ? 0 : (now == side ? run + 1 : 1);
        side = now;
        flat_tops += run == natural_run + 1 ? 1 : 0;
    }
    return flat_tops >= kMinFlatTops;
}

}  // namespace

ColumnFlags inspect_window(std::span<const Sample> window, const AcquisitionPlan& plan, std::int32_t linear_range,
                           float dc_limit) {
    ColumnFlags flags;
    const int natural_run = longest_natural_run(plan);
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
        const ChannelRange range = measure(window, channel);
        flags.set_if(linear_range > 0 && (range.highest >= linear_range || range.lowest <= -linear_range), ColumnFlag::saturated);
        flags.set_if(linear_range > 0 && std::abs(range.mean) > dc_limit * static_cast<float>(linear_range),
                     ColumnFlag::dc_offset);
        flags.set_if(range.lowest == range.highest && channel != kReferenceChannel, ColumnFlag::stuck);
        flags.set_if(has_flat_tops(window, channel, range, natural_run), ColumnFlag::clipped);
    }
    return flags;
}

}  // namespace tricoil::signal

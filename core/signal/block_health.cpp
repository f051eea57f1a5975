#include "core/signal/block_health.hpp"

#include <algorithm>

namespace tricoil::signal {
namespace {

constexpr std::int64_t kNearPeakTurnsQ32 = 193'502'938;  // acos(0.99) / pi of a turn: time of a cosine within 1 % of its peak
constexpr int kNearPeakDivisor = 200;                    // 1 % of half the peak-to-peak value
constexpr int kMinFlatTops = 3;                          // fewer may occur by chance
constexpr std::int64_t kClearSwingCodes = 2000;          // below it, quantisation causes flat tops

struct ChannelRange {
    std::int32_t lowest;
    std::int32_t highest;
    std::int64_t sum;  // of at most 2^31 codes of 32 bits
};

ChannelRange measure(std::span<const Sample> window, std::size_t channel) {
    std::int32_t lowest = window.front()[channel];
    std::int32_t highest = lowest;
    std::int64_t sum = 0;
    for (const Sample& sample : window) {
        const std::int32_t code = sample[channel];
        lowest = code < lowest ? code : lowest;
        highest = code > highest ? code : highest;
        sum += code;
    }
    return {lowest, highest, sum};
}

bool has_flat_tops(std::span<const Sample> window, std::size_t channel, const ChannelRange& range, int natural_run) {
    const std::int64_t swing = std::int64_t{range.highest} - range.lowest;  // below 2^32
    if (swing < kClearSwingCodes) {
        return false;
    }
    const auto margin = static_cast<std::int32_t>(swing / kNearPeakDivisor);
    const std::int32_t upper = range.highest - margin;
    const std::int32_t lower = range.lowest + margin;
    int flat_tops = 0;
    int run = 0;
    int side = 0;
    for (const Sample& sample : window) {
        const std::int32_t code = sample[channel];
        const int now = code >= upper ? 1 : (code <= lower ? -1 : 0);
        run = now == 0 ? 0 : (now == side ? run + 1 : 1);
        side = now;
        flat_tops += run == natural_run + 1 ? 1 : 0;
    }
    return flat_tops >= kMinFlatTops;
}

}  // namespace

int longest_natural_run(std::span<const int> cycles, int window_samples) {
    const int slowest = *std::min_element(cycles.begin(), cycles.end());
    return static_cast<int>((kNearPeakTurnsQ32 * window_samples / std::max(slowest, 1)) >> 32) + 2;  // 2^28 * 2^10 at most
}

ColumnFlags inspect_window(std::span<const Sample> window, int natural_run, std::int32_t linear_range, int offset_divisor) {
    ColumnFlags flags;
    if (window.empty()) {
        return flags;
    }
    const auto samples = static_cast<std::int64_t>(window.size());
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
        const ChannelRange range = measure(window, channel);
        const bool known = linear_range > 0;
        flags.set_if(known && (range.highest >= linear_range || range.lowest <= -linear_range), ColumnFlag::saturated);
        // |sum| / N > range / divisor. With a divisor below 8, both sides of the comparison are below 2^34 N.
        flags.set_if(known && offset_divisor * std::max(range.sum, -range.sum) > samples * linear_range, ColumnFlag::dc_offset);
        flags.set_if(range.lowest == range.highest && channel != kReferenceChannel, ColumnFlag::stuck);
        flags.set_if(has_flat_tops(window, channel, range, natural_run), ColumnFlag::clipped);
    }
    return flags;
}

}  // namespace tricoil::signal

// Block of simultaneous ADC samples: output of a CoilSampler.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/base/time.hpp"
#include "core/signal/excitation.hpp"

namespace tricoil {

/// Channel order of every sample: sensor coils 1-3, then the reference current of the source.
constexpr int kChannels = 4;
constexpr int kReferenceChannel = 3;

/// Codes of the four converters at one instant.
using Sample = std::array<std::int32_t, kChannels>;

/// Longest block of any board; buffers have this size.
constexpr int kMaxBlockSamples = 1024;

/// One block. The samples belong to the sampler and stay valid until its next poll.
struct SampleBlock {
    std::uint8_t sensor = 0;
    Excitation state = Excitation::off;
    std::uint8_t gain_step = 0;
    float scale = 1;                  // volts per code, at the converters
    std::int32_t full_scale = 0;      // largest code magnitude; samples at or beyond it are saturated. 0: unknown
    DeviceTime start{};               // instant of the first sample
    std::uint32_t sequence = 0;       // counts blocks, including lost ones
    std::uint32_t overrun_count = 0;  // converter overruns within this block
    std::span<const Sample> samples{};
};

/// Instant halfway between the first and the last sample, to the nearest microsecond.
inline DeviceTime midpoint(const SampleBlock& block, std::uint32_t sample_rate_millihertz) {
    if (block.samples.empty() || sample_rate_millihertz == 0) {
        return block.start;
    }
    const auto intervals = static_cast<std::int64_t>(block.samples.size()) - 1;
    const std::int64_t twice_rate = 2 * std::int64_t{sample_rate_millihertz};
    return block.start + Microseconds{(intervals * 1'000'000'000 + sample_rate_millihertz) / twice_rate};
}

}  // namespace tricoil

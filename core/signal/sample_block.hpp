// A block of simultaneous ADC samples: what a CoilSampler delivers.
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

/// Longest block that any board delivers; buffers downstream are sized by it.
constexpr int kMaxBlockSamples = 1024;

/// One block. The samples belong to the sampler and stay valid until its next poll.
struct SampleBlock {
    std::uint8_t sensor = 0;
    Excitation state = Excitation::off;
    std::uint8_t gain_step = 0;
    float scale = 1;                  // volts per code, at the converters
    std::int32_t full_scale = 0;      // largest code magnitude; samples at or beyond it are saturated. 0: unknown
    DeviceTime start{};               // instant of the first sample
    DeviceTime midpoint{};            // of the whole block
    std::uint32_t sequence = 0;       // counts blocks, lost ones included
    std::uint32_t overrun_count = 0;  // converter overruns within this block
    std::span<const Sample> samples{};
};

}  // namespace tricoil

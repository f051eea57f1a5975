#include "board/qemu_an386/still_coils.hpp"

#include <cmath>
#include <numbers>

namespace tricoil::board {
namespace {

constexpr float kReferenceCodes = 4e6F;
constexpr std::int32_t kFullScale = 8'388'607;
constexpr std::uint32_t kNoiseCodes = 64;  // width of the uniform noise: 18 codes RMS, typical of a 24-bit converter

/// Linear congruential generator of Numerical Recipes. Only the upper bits are used, because the lower ones are not random.
std::int32_t next_noise(std::uint32_t& state) {
    state = state * 1664525U + 1013904223U;
    return static_cast<std::int32_t>((state >> 16) % kNoiseCodes) - static_cast<std::int32_t>(kNoiseCodes / 2);
}

}  // namespace

Status StillCoilSampler::do_start(const signal::AcquisitionPlan& plan) {
    if (!plan.is_tdm() || static_cast<std::size_t>(plan.block_samples) > samples_.size()) {
        return {StatusCode::invalid_argument, "only TDM with at most 256 samples per block is supported"};
    }
    block_samples_ = static_cast<std::size_t>(plan.block_samples);
    step_rad_ =
        2 * std::numbers::pi_v<float> * static_cast<float>(plan.window_cycles[0]) / static_cast<float>(plan.window_samples);
    block_time_ = microseconds_from_seconds(plan.block_s());
    return {};
}

Status StillCoilSampler::do_poll(SampleBlock& block) {
    const int coil = coil_index(coils_.state());
    if (sequence_ == blocks_) {
        return {StatusCode::end_of_stream, "all requested blocks were delivered"};
    }
    for (std::size_t n = 0; n < block_samples_; ++n) {
        const float carrier = kReferenceCodes * std::cos(step_rad_ * static_cast<float>(n));
        for (int i = 0; i < kSensorCoils; ++i) {
            const float coupling = coil < 0 ? 0 : x_(i, coil);
            samples_[n][static_cast<std::size_t>(i)] = static_cast<std::int32_t>(carrier * coupling) + next_noise(noise_);
        }
        samples_[n][kReferenceChannel] = (coil < 0 ? 0 : static_cast<std::int32_t>(carrier)) + next_noise(noise_);
    }
    block = {};
    block.state = coils_.state();
    block.scale = 3e-7F;
    block.full_scale = kFullScale;
    block.start = clock_.now();
    block.sequence = sequence_++;
    block.samples = std::span<const Sample>(samples_).first(block_samples_);
    clock_.advance(block_time_);
    return {};
}

}  // namespace tricoil::board

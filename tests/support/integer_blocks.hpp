// Blocks of samples of one coupling matrix, computed in integers: the same codes on every processor.
#pragma once

#include <array>

#include "core/fixed/acquisition.hpp"
#include "core/fixed/block_matrix.hpp"

namespace tricoil::test {

/// TDM, one carrier, reference amplitude 2^22 codes; a pseudo-random error of up to +-16 codes on every sample.
class IntegerBlocks {
public:
    static constexpr int kSamples = 200;
    static constexpr fixed::Acquisition kAcquisition{signal::Multiplexing::tdm, 144'000, kSamples, 40, {11, 0, 0}};

    /// Next block for the couplings x 2^-22 (sensor channel to reference). Valid until the next call.
    SampleBlock next(const Mat3<std::int32_t>& x) {
        const auto coil = static_cast<int>(count_ % kSourceCoils);
        for (std::size_t n = 0; n < kSamples; ++n) {
            // The carrier phase starts at the first sample of the window: 11 cycles in 160 samples.
            const auto turns = static_cast<std::uint32_t>((std::uint64_t{n} * 11 << 32) / 160);
            const std::int64_t carrier = fixed::sine_cosine({turns}).cosine.raw();
            for (std::size_t i = 0; i < kSensorCoils; ++i) {
                samples_[n][i] = error() + static_cast<std::int32_t>(carrier * x(static_cast<Index>(i), coil) >> 30);
            }
            samples_[n][kReferenceChannel] = error() + static_cast<std::int32_t>(carrier >> 8);
        }
        SampleBlock block;
        block.state = single_coil(coil);
        block.full_scale = (1 << 23) - 1;
        block.start = device_time_us(std::int64_t{count_} * 1389);
        block.sequence = count_++;
        block.samples = samples_;
        return block;
    }

    /// The samples of the last block, for tests that corrupt them.
    [[nodiscard]] std::array<Sample, kSamples>& samples() { return samples_; }

private:
    std::int32_t error() {
        random_ = random_ * 1'664'525U + 1'013'904'223U;
        return static_cast<std::int32_t>(random_ >> 27) - 16;
    }

    std::array<Sample, kSamples> samples_{};
    std::uint32_t random_ = 1;
    std::uint32_t count_ = 0;
};

}  // namespace tricoil::test

// Couplings of the low band from consecutive blocks of samples.
#pragma once

#include <array>
#include <complex>
#include <optional>

#include "core/base/time.hpp"
#include "core/geometry/types.hpp"
#include "core/signal/demodulator.hpp"
#include "core/signal/low_band_plan.hpp"

namespace tricoil::signal {

/// Complex couplings of one window: row = sensor coil, column = source coil, as in a signal matrix.
struct LowBandMatrix {
    DeviceTime midpoint{};
    Mat3<double> in_phase = Mat3<double>::Zero();
    Mat3<double> quadrature = Mat3<double>::Zero();
    Mat3<double> sigma = Mat3<double>::Zero();  // standard deviation per entry, equal in phase and in quadrature
};

struct LowBandParams {
    LowBandPlan plan;
    ChannelResponse<double> response = unit_response<double>();  // at the low tones, relative to the reference channel
    double min_reference_v = 10e-3;                              // amplitude below which there is no result
};

/// A Hann window is a sum of three tones: its lock-in is the lock-in of the tone minus half of those one cycle per window above
/// and below. So each block is reduced to three sums per tone and channel, and a window combines the sums of its blocks.
class LowBandDemodulator {
public:
    /// `high`: the plan of the same blocks.
    LowBandDemodulator(const AcquisitionPlan& high, const LowBandParams& params);

    /// Adds one block. Returns a matrix once half a window of blocks has been added since the last one and the window has no gap.
    /// usable: false if samples of the block are saturated or otherwise wrong; such a block is a gap.
    std::optional<LowBandMatrix> add(const SampleBlock& block, bool usable);

private:
    static constexpr std::size_t kSidebands = 3;  // below, at and above the tone
    using ToneSums = std::array<ChannelPhasors<double>, kSidebands>;
    using BlockSums = std::array<ToneSums, kSourceCoils>;

    void sum_block(std::span<const Sample> samples);
    void update_noise(std::span<const Sample> samples);
    [[nodiscard]] ChannelPhasors<double> window_phasors(std::size_t tone) const;
    [[nodiscard]] std::optional<LowBandMatrix> combine(const SampleBlock& last) const;

    LowBandParams params_;
    std::array<std::array<Oscillator<double>, kSidebands>, kSourceCoils> oscillators_;
    NoiseEstimator<double> noise_estimator_;
    std::array<double, kChannels> sample_power_{};                   // running noise power per channel, codes squared
    std::array<BlockSums, LowBandPlan::kMaxWindowBlocks> blocks_{};  // ring
    std::size_t next_ = 0;                                           // place of the next block in the ring
    int filled_ = 0;                                                 // consecutive blocks in the ring, at most one window
    int since_last_ = 0;                                             // blocks since the last matrix
    DeviceTime last_start_{};
    std::uint8_t gain_step_ = 0;
};

}  // namespace tricoil::signal

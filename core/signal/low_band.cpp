#include "core/signal/low_band.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tricoil::signal {
namespace {

constexpr double kHannNoise = 1.5;              // noise bandwidth of a Hann window relative to a rectangular one
constexpr double kBlockNoiseWeight = 1.0 / 16;  // of a new block in the running noise power
constexpr Microseconds kStartTolerance{2};

}  // namespace

LowBandDemodulator::LowBandDemodulator(const AcquisitionPlan& high, const LowBandParams& params)
    : params_(params), noise_estimator_(high) {
    const LowBandPlan& plan = params.plan;
    for (std::size_t j = 0; j < kSourceCoils; ++j) {
        for (std::size_t k = 0; k < kSidebands; ++k) {
            const int cycles = plan.block_cycles[j] * plan.window_blocks + static_cast<int>(k) - 1;
            oscillators_[j][k] = Oscillator<double>(cycles, plan.window_blocks * plan.block_samples);
        }
    }
}

std::optional<LowBandMatrix> LowBandDemodulator::add(const SampleBlock& block, bool usable) {
    const Microseconds expected = microseconds_from_seconds(params_.plan.block_s());
    const Microseconds off = block.start - last_start_ - expected;
    const bool follows = off <= kStartTolerance && off >= -kStartTolerance && block.gain_step == gain_step_;
    last_start_ = block.start;
    gain_step_ = block.gain_step;
    if (!usable || block.samples.size() != static_cast<std::size_t>(params_.plan.block_samples)) {
        filled_ = 0;
        return std::nullopt;
    }
    filled_ = follows ? filled_ : 0;
    update_noise(block.samples);
    sum_block(block.samples);
    filled_ = std::min(filled_ + 1, params_.plan.window_blocks);
    ++since_last_;
    if (filled_ < params_.plan.window_blocks || since_last_ < params_.plan.hop_blocks()) {
        return std::nullopt;
    }
    since_last_ = 0;
    return combine(block);
}

void LowBandDemodulator::update_noise(std::span<const Sample> samples) {
    const auto sigma = noise_estimator_.sample_sigma(samples);
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
        const double power = sigma[channel] * sigma[channel];
        sample_power_[channel] += (filled_ > 0 ? kBlockNoiseWeight : 1) * (power - sample_power_[channel]);
    }
}

void LowBandDemodulator::sum_block(std::span<const Sample> samples) {
    for (std::size_t j = 0; j < kSourceCoils; ++j) {
        for (std::size_t k = 0; k < kSidebands; ++k) {
            blocks_[next_][j][k] = lock_in(oscillators_[j][k], samples);
        }
    }
    next_ = (next_ + 1) % static_cast<std::size_t>(params_.plan.window_blocks);
}

/// Amplitudes of one tone over the window, with the phase at its first sample; codes.
ChannelPhasors<double> LowBandDemodulator::window_phasors(std::size_t tone) const {
    const auto count = static_cast<std::size_t>(params_.plan.window_blocks);
    ChannelPhasors<double> sum{};
    for (std::size_t n = 0; n < count; ++n) {  // the oldest block is at next_
        const ToneSums& block = blocks_[(next_ + n) % count][tone];
        const double turn = 2 * std::numbers::pi * static_cast<double>(n) / static_cast<double>(count);
        for (std::size_t channel = 0; channel < kChannels; ++channel) {
            const auto below = block[0][channel] * std::polar(1.0, turn);
            const auto above = block[2][channel] * std::polar(1.0, -turn);
            sum[channel] += block[1][channel] - 0.5 * (below + above);
        }
    }
    for (auto& value : sum) {
        value /= static_cast<double>(count);
    }
    return sum;
}

std::optional<LowBandMatrix> LowBandDemodulator::combine(const SampleBlock& last) const {
    const LowBandPlan& plan = params_.plan;
    const double samples = plan.window_blocks * plan.block_samples;
    LowBandMatrix out;
    out.midpoint = last.start + microseconds_from_seconds(plan.block_s() - plan.window_s() / 2);
    for (std::size_t j = 0; j < kSourceCoils; ++j) {
        const ChannelPhasors<double> phasors = window_phasors(j);
        const std::complex<double> reference = phasors[kReferenceChannel];
        const double amplitude = std::abs(reference);
        if (!(amplitude * static_cast<double>(last.scale) >= params_.min_reference_v)) {
            return std::nullopt;
        }
        for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
            const std::complex<double> response = params_.response[j][coil];
            const std::complex<double> ratio = phasors[coil] / reference;
            const std::complex<double> coupling = ratio / response;
            const auto row = static_cast<Eigen::Index>(coil);
            const auto column = static_cast<Eigen::Index>(j);
            out.in_phase(row, column) = coupling.real();
            out.quadrature(row, column) = coupling.imag();
            const double power = sample_power_[coil] + std::norm(ratio) * sample_power_[kReferenceChannel];
            out.sigma(row, column) = std::sqrt(2 * kHannNoise * power / samples) / (amplitude * std::abs(response));
        }
    }
    return out;
}

}  // namespace tricoil::signal

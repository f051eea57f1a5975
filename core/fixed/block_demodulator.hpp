// Couplings, noise and flags of a block of samples, in integers. Twin of signal::Demodulator.
#pragma once

#include "core/base/static_vector.hpp"
#include "core/fixed/acquisition.hpp"
#include "core/fixed/demodulator.hpp"
#include "core/fixed/noise_estimate.hpp"
#include "core/signal/column.hpp"

namespace tricoil::fixed {

/// Factor that converts a quotient of phasors to a coupling: the reciprocal of signal::ChannelResponse, (re + i im) * 2^exponent.
/// The magnitudes of re and im are at most one.
struct Correction {
    Unit re = 1;
    Unit im = 0;
    int exponent = 0;
};

struct DemodulatorParams {
    std::array<std::array<Correction, kSensorCoils>, kSourceCoils> corrections{};  // [carrier][coil]
    std::int32_t least_reference = 33'554;  // amplitude in codes: 10 mV of 2.5 V in 24 bits
    std::int32_t low_signal_ratio = 10;     // a column below this multiple of sigma (20 dB) is flagged low_signal
    Unit linear_share = 1;                  // share of full scale up to which the sensor amplifiers are linear
    int noise_shift = 4;                    // weight of a new block in the running noise power: 2^-noise_shift
    int noise_jump = 4;                     // above this multiple of the running power, a block replaces it at once
};

/// Errors (invalid_argument): corrections above one or with exponents above 64, limits out of range.
Status check(const DemodulatorParams& params);

/// Couplings of the three sensor coils to one source coil.
struct Column {
    Excitation state = Excitation::off;
    DeviceTime midpoint{};
    BlockColumn couplings;
    Scaled variance;  // mean of the variances of the three entries, coupling units squared
    ColumnFlags flags;
};

using Columns = StaticVector<Column, kSourceCoils>;

class Demodulator {
public:
    /// Both arguments must pass check().
    Demodulator(const Acquisition& acquisition, const DemodulatorParams& params);

    /// Couplings of one block, after removal of mains hum. They are zero if the flag no_reference is set.
    /// Errors (invalid_argument): length differs from the plan, or excitation state is not in the plan.
    Result<Columns> demodulate(const SampleBlock& block);

    [[nodiscard]] bool fits_length(const SampleBlock& block) const {
        return block.samples.size() == static_cast<std::size_t>(acquisition_.block_samples);
    }

private:
    using Phasors = std::array<Phasor, kChannels>;

    void update_noise(std::span<const Sample> window);
    [[nodiscard]] Column make_column(const SampleBlock& block, std::size_t source_coil, std::size_t carrier,
                                     const Phasors& phasors, ColumnFlags flags) const;
    void correct(std::size_t carrier, BlockColumn& column) const;
    void judge_noise(std::size_t carrier, const Phasor& reference, Column& column) const;

    Acquisition acquisition_;
    DemodulatorParams params_;
    StaticVector<Oscillator, kSourceCoils> oscillators_;
    NoiseEstimator noise_estimator_;
    SampleVariances sample_variance_{};
    bool has_noise_ = false;
    int natural_run_;
};

}  // namespace tricoil::fixed

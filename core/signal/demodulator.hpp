// From a block of samples to signed couplings with their noise: lock-in, division by the reference current, channel response.
#pragma once

#include <array>
#include <complex>

#include "core/base/static_vector.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "core/signal/column.hpp"
#include "core/signal/gain_step.hpp"
#include "core/signal/lock_in.hpp"
#include "core/signal/noise_estimate.hpp"
#include "core/signal/oscillator.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::signal {

/// Complex response of each sensor channel relative to the reference channel, per carrier: [carrier][coil]. Dividing by it leaves
/// the real coupling. A coil's voltage is the derivative of the flux, so an ideal channel has response i w / w0.
template <typename Scalar>
using ChannelResponse = std::array<std::array<std::complex<Scalar>, kSensorCoils>, kSourceCoils>;

template <typename Scalar>
constexpr ChannelResponse<Scalar> unit_response() {
    ChannelResponse<Scalar> response{};
    for (auto& carrier : response) {
        carrier.fill({1, 0});
    }
    return response;
}

template <typename Scalar>
struct DemodulatorParams {
    ChannelResponse<Scalar> response = unit_response<Scalar>();
    GainSteps<Scalar> gain_steps{};             // of the amplifier, by SampleBlock::gain_step
    Scalar sigma_floor = Scalar(1e-9);          // coupling units: the converter's quantisation, in force even without noise
    Scalar min_reference_v = Scalar(10e-3);     // amplitude of the reference current's channel below which there is none
    Scalar low_signal_ratio = 10;               // a column shorter than this many sigma is too little signal (20 dB)
    float linear_share = 1;                     // of full scale, up to which the amplifiers before the converter are linear
    float dc_limit = 0.25F;                     // allowed offset as a share of that
    Scalar noise_smoothing = Scalar(1.0 / 16);  // weight of a new block in the running noise power
    Scalar noise_jump = 4;                      // a block with so many times the running power counts as noisy at once
};

/// Columns of one block: one for TDM, three for FDM.
template <typename Scalar>
using Columns = StaticVector<Column<Scalar>, kSourceCoils>;

template <typename Scalar>
class Demodulator {
public:
    Demodulator(const AcquisitionPlan& plan, const DemodulatorParams<Scalar>& params);

    /// The couplings of one block. A column with a flag is still delivered; no_reference leaves its values zero.
    /// Mains hum is taken out. Where coils are never off (FDM) the first block of another gain step holds the switching: its
    /// columns are flagged as overrun.
    /// Errors (invalid_argument): block of another length than planned, of a state that the plan does not use, or of a gain step
    /// beyond all.
    Result<Columns<Scalar>> demodulate(const SampleBlock& block);

private:
    using CarrierPhasors = std::array<ChannelPhasors<Scalar>, kSourceCoils>;
    [[nodiscard]] CarrierPhasors read_carriers(std::span<const Sample> window) const;
    void update_noise(std::span<const Sample> window);
    Column<Scalar> make_column(const SampleBlock& block, int source_coil, int carrier, const ChannelPhasors<Scalar>& phasors,
                               ColumnFlags flags) const;
    [[nodiscard]] std::complex<Scalar> response(const SampleBlock& block, int carrier, std::size_t coil) const;

    AcquisitionPlan plan_;
    DemodulatorParams<Scalar> params_;
    std::array<Oscillator<Scalar>, kSourceCoils> oscillators_;
    std::array<Scalar, kSourceCoils> carrier_rad_s_{};
    NoiseEstimator<Scalar> noise_estimator_;
    std::array<Scalar, kChannels> sample_power_{};  // running noise power per channel, codes squared
    bool has_noise_ = false;
    std::uint8_t gain_step_ = 0;      // of the newest block
    Microseconds midpoint_offset_{};  // from a block's first sample to the middle of its window
};

extern template class Demodulator<float>;
extern template class Demodulator<double>;

}  // namespace tricoil::signal

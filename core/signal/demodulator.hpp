// Couplings with sign and noise from a block of samples: lock-in, division by the reference current and by the channel response.
#pragma once

#include <array>
#include <complex>

#include "core/base/static_vector.hpp"
#include "core/signal/acquisition_plan.hpp"
#include "core/signal/column.hpp"
#include "core/signal/converter_errors.hpp"
#include "core/signal/gain_step.hpp"
#include "core/signal/lock_in.hpp"
#include "core/signal/noise_estimate.hpp"
#include "core/signal/oscillator.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::signal {

/// Complex response of each sensor channel relative to the reference channel, per carrier of the plan: [carrier][coil]. Division
/// by it gives the real coupling. A coil's voltage is the derivative of the flux, so an ideal channel has the response i w / w0.
template <typename Scalar>
using ChannelResponse = std::array<std::array<std::complex<Scalar>, kSensorCoils>, kMaxCarriers>;

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
    GainSteps<Scalar> gain_steps{};          // of the amplifier, by SampleBlock::gain_step
    ConverterErrors converters;              // of the sensor channels
    int conversions = 1;                     // of a converter, whose sum is a sample
    Scalar ladder_s = 0;                     // time constant of the capacitor at the end of its feedback ladder; 0: none
    Scalar sigma_floor = Scalar(1e-9);       // coupling units: quantisation of the converter, the smallest sigma
    Scalar min_reference_v = Scalar(10e-3);  // amplitude of the reference channel at full drive below which no_reference is set
    Scalar low_signal_ratio = 10;            // a column below this multiple of sigma (20 dB) is flagged low_signal
    float linear_share = 1;                  // share of full scale up to which the sensor amplifiers are linear
    Scalar noise_smoothing = Scalar(1.0 / 16);  // weight of a new block in the running noise power
    Scalar noise_jump = 4;                      // above this multiple of the running power, a block replaces it at once
};

/// Columns of one block: one for TDM, three for FDM; with two bands three of the high, then three of the low band.
template <typename Scalar>
using Columns = StaticVector<MeasuredColumn<Scalar>, kMaxCarriers>;

template <typename Scalar>
class Demodulator {
public:
    Demodulator(const AcquisitionPlan& plan, const DemodulatorParams<Scalar>& params);

    /// Couplings of one block, after removal of mains hum from the high band. At the low carriers this removal would multiply the
    /// noise by up to four; hum is zero in the mean over a whole number of its cycles.
    /// Flagged columns are delivered too; no_reference sets their values to zero. In FDM the coils are always driven, so the
    /// first block of another gain step contains the switching transient: its columns are flagged gain_changed.
    /// Errors (invalid_argument): length differs from the plan, the excitation state is not in the plan, or the gain step is
    /// out of range.
    Result<Columns<Scalar>> demodulate(const SampleBlock& block);

private:
    using Levels = decltype(MeasuredColumn<Scalar>::level);
    using CarrierPhasors = std::array<ChannelPhasors<Scalar>, kMaxCarriers>;
    [[nodiscard]] CarrierPhasors read_carriers(std::span<const Sample> window) const;
    void update_noise(std::span<const Sample> window);
    MeasuredColumn<Scalar> make_column(const SampleBlock& block, int carrier, const ChannelPhasors<Scalar>& phasors,
                                       ColumnFlags flags) const;
    [[nodiscard]] std::complex<Scalar> response(const SampleBlock& block, int carrier, std::size_t coil) const;
    Levels correct_converters(const SampleBlock& block, int carrier, ChannelPhasors<Scalar>& phasors) const;

    AcquisitionPlan plan_;
    DemodulatorParams<Scalar> params_;
    std::array<Oscillator<Scalar>, kMaxCarriers> oscillators_;
    std::array<Scalar, kMaxCarriers> carrier_rad_s_{};
    std::array<float, kMaxCarriers> sum_gain_{};  // amplitude of a sample relative to that of its conversions
    NoiseEstimator<Scalar> noise_estimator_;
    int natural_run_;                               // see longest_natural_run()
    std::array<Scalar, kChannels> sample_power_{};  // running noise power per channel, codes squared
    bool has_noise_ = false;
    std::uint8_t gain_step_ = 0;      // of the newest block
    Microseconds midpoint_offset_{};  // from the first sample of a block to the middle of its window
};

extern template class Demodulator<float>;
extern template class Demodulator<double>;

}  // namespace tricoil::signal

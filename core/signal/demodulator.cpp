#include "core/signal/demodulator.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/base/precision.hpp"
#include "core/signal/block_health.hpp"
#include "core/signal/complex_division.hpp"
#include "core/signal/unit_phasor.hpp"

namespace tricoil::signal {
namespace {

std::int32_t linear_range(std::int32_t full_scale, float share) {
    return share < 1 ? static_cast<std::int32_t>(share * static_cast<float>(full_scale)) : full_scale;
}

/// Amplitude of the mean of some conversions in a sample, relative to that of a conversion. turns: of the carrier per sample,
/// less than one. The sum of n phasors at equal steps is sin(pi turns) / sin(pi turns / n).
float gain_of_sum(double turns, int conversions) {
    return static_cast<float>(unit_phasor(turns / 2).imag() / (conversions * unit_phasor(turns / 2 / conversions).imag()));
}

}  // namespace

template <typename Scalar>
Demodulator<Scalar>::Demodulator(const AcquisitionPlan& plan, const DemodulatorParams<Scalar>& params)
    : plan_(plan),
      params_(params),
      noise_estimator_(plan),
      natural_run_(longest_natural_run(plan.high_cycles(), plan.window_samples)) {
    for (std::size_t j = 0; j < static_cast<std::size_t>(plan.carriers()); ++j) {
        oscillators_[j] = Oscillator<Scalar>(plan.window_cycles[j], plan.window_samples);
        carrier_rad_s_[j] = 2 * std::numbers::pi_v<Scalar> * static_cast<Scalar>(plan.params.carrier_hz[j]);
        sum_gain_[j] = gain_of_sum(plan.params.carrier_hz[j] / plan.params.sample_rate_hz, params.conversions);
    }
    const double middle_samples = plan.params.guard_samples + 0.5 * (plan.window_samples - 1);
    midpoint_offset_ = microseconds_from_seconds(middle_samples / plan.params.sample_rate_hz);
}

template <typename Scalar>
Result<Columns<Scalar>> Demodulator<Scalar>::demodulate(const SampleBlock& block) {
    if (block.samples.size() != static_cast<std::size_t>(plan_.block_samples)) {
        return Status{StatusCode::invalid_argument, "block length differs from the plan"};
    }
    const bool state_fits = plan_.is_tdm() ? coil_index(block.state) >= 0 : block.state == Excitation::all;
    if (!state_fits) {
        return Status{StatusCode::invalid_argument, "block was sampled in an excitation state that the plan does not use"};
    }
    if (block.gain_step >= params_.gain_steps.size()) {
        return Status{StatusCode::invalid_argument, "block was sampled with a gain step that is not calibrated"};
    }
    const auto window = block.samples.subspan(static_cast<std::size_t>(plan_.params.guard_samples));
    ColumnFlags flags = inspect_window(window, natural_run_, linear_range(block.full_scale, params_.linear_share));
    const bool switched = has_noise_ && block.gain_step != gain_step_;
    flags.set_if(switched && !plan_.is_tdm(), ColumnFlag::gain_changed);
    has_noise_ = has_noise_ && !switched;  // noise in codes depends on the gain
    gain_step_ = block.gain_step;
    update_noise(window);
    CarrierPhasors phasors = read_carriers(window);
    Columns<Scalar> columns;
    for (int carrier = 0; carrier < plan_.carriers(); ++carrier) {
        ChannelPhasors<Scalar>& of_carrier = phasors[static_cast<std::size_t>(carrier)];
        const Levels levels = correct_converters(block, carrier, of_carrier);
        columns.push_back(make_column(block, carrier, of_carrier, flags));
        columns[columns.size() - 1].level = levels;
        columns[columns.size() - 1].gain_step = block.gain_step;
    }
    return columns;
}

/// Amplitude and phase of each carrier, in the high band without hum.
template <typename Scalar>
auto Demodulator<Scalar>::read_carriers(std::span<const Sample> window) const -> CarrierPhasors {
    const auto count = static_cast<std::size_t>(plan_.carriers());
    CarrierPhasors phasors{};
    for (std::size_t j = 0; j < count; ++j) {
        phasors[j] = lock_in(oscillators_[j], window);
    }
    const auto step = hum_step<Scalar>(std::span(oscillators_).first(count), std::span(phasors).first(count), window);
    for (std::size_t j = 0; j < std::min<std::size_t>(count, kSourceCoils); ++j) {
        const auto hum = hum_leakage(oscillators_[j], step, window.size());
        for (std::size_t channel = 0; channel < kChannels; ++channel) {
            phasors[j][channel] -= hum[channel];
        }
    }
    return phasors;
}

template <typename Scalar>
void Demodulator<Scalar>::update_noise(std::span<const Sample> window) {
    const auto sigma = noise_estimator_.sample_sigma(window);
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
        Scalar& running = sample_power_[channel];
        const Scalar power = sigma[channel] * sigma[channel];
        const bool slowly = has_noise_ && !(power > params_.noise_jump * running);
        running += (slowly ? params_.noise_smoothing : Scalar(1)) * (power - running);
    }
    has_noise_ = true;
}

/// Response of one channel relative to the reference, including the amplifier's gain.
template <typename Scalar>
std::complex<Scalar> Demodulator<Scalar>::response(const SampleBlock& block, int carrier, std::size_t coil) const {
    const auto j = static_cast<std::size_t>(carrier);
    const std::complex<Scalar> gain = params_.gain_steps[block.gain_step].response(coil, carrier_rad_s_[j], params_.ladder_s);
    const std::complex<Scalar> channel = params_.response[j][coil];
    return multiply(channel, gain);
}

/// Corrects the phasors for the errors of their converters. Returns MeasuredColumn::level: the amplitudes of the conversions;
/// zero if the columns are corrected, or if each converter has several carriers at the same time.
template <typename Scalar>
auto Demodulator<Scalar>::correct_converters(const SampleBlock& block, int carrier, ChannelPhasors<Scalar>& phasors) const
    -> Levels {
    Levels levels{};
    const float unit = static_cast<float>(block.full_scale) * sum_gain_[static_cast<std::size_t>(carrier)];
    const bool is_corrected = !(params_.converters == ConverterErrors{});
    for (std::size_t coil = 0; coil < kSensorCoils && unit > 0; ++coil) {
        const float amplitude = static_cast<float>(std::abs(phasors[coil])) / unit;
        if (is_corrected) {
            phasors[coil] *= static_cast<Scalar>(params_.converters.correction(block.gain_step, coil, amplitude, plan_.is_tdm()));
        } else if (plan_.is_tdm()) {
            levels[coil] = static_cast<std::uint16_t>(std::clamp(kLevelsPerFullScale * amplitude, 1.0F, 65535.0F));
        }
    }
    return levels;
}

template <typename Scalar>
MeasuredColumn<Scalar> Demodulator<Scalar>::make_column(const SampleBlock& block, int carrier,
                                                        const ChannelPhasors<Scalar>& phasors, ColumnFlags flags) const {
    MeasuredColumn<Scalar> column;
    column.sensor = block.sensor;
    column.state = plan_.is_tdm() ? block.state : single_coil(carrier % kSourceCoils);
    column.state_sequence = block.sequence;
    column.sequence = block.sequence;
    column.midpoint = block.start + midpoint_offset_;
    column.flags = flags;
    column.flags.set_if(block.overrun_count != 0, ColumnFlag::overrun);
    column.flags.set_if(carrier >= kSourceCoils, ColumnFlag::low_band);

    const std::complex<Scalar> reference = phasors[kReferenceChannel];
    const Scalar reference_amplitude = std::abs(reference);
    const Scalar least_v = params_.min_reference_v * params_.gain_steps[block.gain_step].drive;
    if (reference_amplitude * static_cast<Scalar>(block.scale) < least_v) {
        column.flags.set(ColumnFlag::no_reference);
        column.sigma.setConstant(params_.sigma_floor);
        return column;
    }
    const Scalar amplitude_noise = std::sqrt(Scalar(2) / static_cast<Scalar>(plan_.window_samples)) / reference_amplitude;
    const Scalar reference_power = sample_power_[kReferenceChannel];
    for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
        const std::complex<Scalar> amplified = response(block, carrier, coil);
        const std::complex<Scalar> ratio = divide(phasors[coil], reference);
        const std::complex<Scalar> coupling = divide(ratio, amplified);
        const auto entry = static_cast<Index>(coil);
        column.in_phase(entry) = coupling.real();
        column.quadrature(entry) = coupling.imag();
        // Noise of the coil's own channel, and of the reference multiplied by the ratio.
        const Scalar power = params_.gain_steps[block.gain_step].noise * sample_power_[coil] + std::norm(ratio) * reference_power;
        column.sigma(entry) = std::max(params_.sigma_floor, amplitude_noise * std::sqrt(power) / std::abs(amplified));
    }
    column.flags.set_if(column.in_phase.norm() < params_.low_signal_ratio * column.sigma.maxCoeff(), ColumnFlag::low_signal);
    return column;
}

template class Demodulator<float>;
#if TRICOIL_SCALARS & 2  // double
template class Demodulator<double>;
#endif

}  // namespace tricoil::signal

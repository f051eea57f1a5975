#include "core/fixed/block_demodulator.hpp"

#include "core/fixed/hum.hpp"
#include "core/fixed/sizes.hpp"
#include "core/signal/block_health.hpp"

namespace tricoil::fixed {
namespace {

constexpr std::uint64_t kMaxCorrection = 64;  // largest exponent

/// (a^2 + b^2) * 2^(2 exponent); parts of 32 bits.
Scaled squared_size(std::int32_t a, std::int32_t b, int exponent) {
    const std::int64_t squares = (std::int64_t{a} * a >> 1) + (std::int64_t{b} * b >> 1);  // below 2^63
    return normalise(squares, 2 * bounded_exponent(exponent) + 1);
}

Scaled squared_size(const Phasor& phasor) {
    const Scaled re = normalise(phasor.re, 0);
    const Scaled im = normalise(phasor.im, 0);
    return add(multiply(re, re), multiply(im, im));
}

}  // namespace

Status check(const DemodulatorParams& params) {
    for (const auto& carrier : params.corrections) {
        for (const Correction& correction : carrier) {
            if (abs(correction.re) > Unit(1) || abs(correction.im) > Unit(1) || size_of(correction.exponent) > kMaxCorrection) {
                return {StatusCode::invalid_argument, "corrections must have parts of at most one and exponents within 64"};
            }
        }
    }
    if (params.least_reference < 1 || params.least_reference > kFullScaleCode || params.low_signal_ratio < 1) {
        return {StatusCode::invalid_argument, "reference must be 1 to 2^23 codes, and the signal ratio positive"};
    }
    if (params.linear_share.raw() <= 0 || params.linear_share > Unit(1)) {
        return {StatusCode::invalid_argument, "linear share of full scale must be above zero, at most one"};
    }
    if (params.noise_shift < 0 || params.noise_shift > 16 || params.noise_jump < 1) {
        return {StatusCode::invalid_argument, "noise shift must be 0 to 16, and noise jump at least 1"};
    }
    return {};
}

Demodulator::Demodulator(const Acquisition& acquisition, const DemodulatorParams& params)
    : acquisition_(acquisition),
      params_(params),
      noise_estimator_(acquisition),
      natural_run_(signal::longest_natural_run(std::span(acquisition.window_cycles).first(acquisition.carriers()),
                                               acquisition.window_samples())) {
    for (std::size_t j = 0; j < acquisition.carriers(); ++j) {
        oscillators_.push_back(Oscillator(acquisition.window_cycles[j], acquisition.window_samples()));
    }
}

Result<Columns> Demodulator::demodulate(const SampleBlock& block) {
    if (!fits_length(block)) {
        return Status{StatusCode::invalid_argument, "block length differs from the plan"};
    }
    const bool state_fits = acquisition_.is_tdm() ? coil_index(block.state) >= 0 : block.state == Excitation::all;
    if (!state_fits) {
        return Status{StatusCode::invalid_argument, "block was sampled in an excitation state that the plan does not use"};
    }
    const auto window = block.samples.subspan(static_cast<std::size_t>(acquisition_.guard_samples));
    const ColumnFlags flags =
        signal::inspect_window(window, natural_run_, product<0>(params_.linear_share, Fixed<0>(block.full_scale)).raw());
    update_noise(window);
    std::array<Phasors, kSourceCoils> phasors{};
    const std::size_t count = oscillators_.size();
    for (std::size_t j = 0; j < count; ++j) {
        phasors[j] = lock_in(oscillators_[j], window);
    }
    const HumStep step =
        hum_step(std::span<const Oscillator>(oscillators_.begin(), count), std::span(phasors).first(count), window);
    Columns columns;
    for (std::size_t j = 0; j < count; ++j) {
        remove_hum(oscillators_[j], step, phasors[j]);
        const std::size_t source_coil = acquisition_.is_tdm() ? static_cast<std::size_t>(coil_index(block.state)) : j;
        columns.push_back(make_column(block, source_coil, j, phasors[j], flags));
    }
    return columns;
}

void Demodulator::update_noise(std::span<const Sample> window) {
    const SampleVariances variances = noise_estimator_.sample_variance(window);
    for (std::size_t channel = 0; channel < kChannels; ++channel) {
        std::int64_t& running = sample_variance_[channel];  // below 2^63, like the estimates
        const std::int64_t change = variances[channel] - running;
        const bool slowly = has_noise_ && variances[channel] / std::max(params_.noise_jump, 1) <= running;
        running += slowly ? shift_right_rounded(change, std::clamp(params_.noise_shift, 0, 16)) : change;
    }
    has_noise_ = true;
}

Column Demodulator::make_column(const SampleBlock& block, std::size_t source_coil, std::size_t carrier, const Phasors& phasors,
                                ColumnFlags flags) const {
    Column column;
    column.state = single_coil(static_cast<int>(source_coil));
    column.midpoint = block.start + acquisition_.midpoint_offset();
    column.flags = flags;
    column.flags.set_if(block.overrun_count != 0, ColumnFlag::overrun);
    const auto quotients = couplings(phasors, static_cast<std::size_t>(acquisition_.window_samples()), params_.least_reference);
    if (!quotients.ok()) {
        column.flags.set(ColumnFlag::no_reference);
        return column;
    }
    column.couplings = *quotients;
    correct(carrier, column.couplings);
    judge_noise(carrier, phasors[kReferenceChannel], column);
    return column;
}

/// Entries have magnitudes below 2^31, corrections at most 2^30. Sums of two products are below 2^62 and are reduced to 30 bits.
void Demodulator::correct(std::size_t carrier, BlockColumn& column) const {
    const auto& corrections = params_.corrections[carrier];
    int most = corrections[0].exponent;
    for (const Correction& correction : corrections) {
        most = std::max(most, correction.exponent);
    }
    for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
        const Correction& correction = corrections[coil];
        const auto i = static_cast<Index>(coil);
        const std::int64_t a = column.in_phase(i);
        const std::int64_t b = column.quadrature(i);
        const std::int64_t re = a * correction.re.raw() - b * correction.im.raw();
        const std::int64_t im = a * correction.im.raw() + b * correction.re.raw();
        const int shift = 31 + std::min(bounded_exponent(most) - bounded_exponent(correction.exponent), 32);
        column.in_phase(i) = saturate(shift_right_rounded(re, shift));
        column.quadrature(i) = saturate(shift_right_rounded(im, shift));
    }
    column.exponent += 1 + bounded_exponent(most);
}

/// Variance of an entry: 2 / (N A^2) (v |g|^2 + |x|^2 v_reference), with A the reference's amplitude, g the correction and x the
/// entry. A lock-in's sum is (A N / 2) * 2^30, so 2 / (N A^2) = N * 2^59 / |sum|^2.
void Demodulator::judge_noise(std::size_t carrier, const Phasor& reference, Column& column) const {
    const Scaled factor = divide(normalise(acquisition_.window_samples(), 59), squared_size(reference));
    const Scaled reference_variance = normalise(sample_variance_[kReferenceChannel], -16);
    const BlockColumn& x = column.couplings;
    Scaled sum;
    Scaled most;
    Scaled power;
    for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
        const auto i = static_cast<Index>(coil);
        const Correction& g = params_.corrections[carrier][coil];
        const Scaled own = multiply(normalise(sample_variance_[coil], -16),
                                    squared_size(g.re.raw(), g.im.raw(), bounded_exponent(g.exponent) - 30));
        const Scaled carried = multiply(squared_size(x.in_phase(i), x.quadrature(i), x.exponent), reference_variance);
        const Scaled variance = multiply(factor, add(own, carried));
        sum = add(sum, variance);
        most = is_less(most, variance) ? variance : most;
        power = add(power, squared_size(x.in_phase(i), 0, x.exponent));
    }
    column.variance = divide(sum, normalise(kSensorCoils, 0));
    const Scaled limit = normalise(std::int64_t{params_.low_signal_ratio} * params_.low_signal_ratio, 0);
    column.flags.set_if(is_less(power, multiply(limit, most)), ColumnFlag::low_signal);
}

}  // namespace tricoil::fixed

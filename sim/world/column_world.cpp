#include "sim/world/column_world.hpp"

#include <numbers>
#include <stdexcept>

#include "core/linear/eigen.hpp"

namespace tricoil::sim {
namespace {

void refuse_sample_faults(const std::vector<Fault>& faults) {
    for (const Fault& fault : faults) {
        if (fault.kind == FaultKind::stuck_channel || fault.kind == FaultKind::overload ||
            fault.kind == FaultKind::broken_stage) {
            throw std::invalid_argument("stuck_channel, overload and broken_stage act on samples");
        }
    }
}

}  // namespace

ColumnWorld::ColumnWorld(CoilWorld& world, const std::vector<Fault>& faults)
    : world_(world),
      plan_(world.plan()),
      demodulator_(world.demodulation()),
      noise_(plan_),
      sample_sigma_v_(world.sample_sigma_v()),
      middle_s_((plan_.params.guard_samples + 0.5 * (plan_.window_samples - 1)) / plan_.params.sample_rate_hz),
      random_(world.params().seed),
      drop_random_(world.params().seed + 1) {
    refuse_sample_faults(faults);
    const double half_window_s = 0.5 * (plan_.window_samples - 1) / plan_.params.sample_rate_hz;
    for (std::size_t j = 0; j < static_cast<std::size_t>(plan_.carriers()); ++j) {
        current_phase_[j] = std::polar(1.0, -carrier_rad_s(j) * half_window_s);
    }
    find_motion_lags();
}

/// A rate X' induces X' / w at the own carrier w. The signal X' t sin(w_j t) of each carrier also leaks into the phasor of
/// carrier i, where t is zero in the middle of the window. In TDM the phase of the carrier differs between the slots, so that
/// part is left out; it is at most half of the first.
void ColumnWorld::find_motion_lags() {
    motion_lag_s_.setZero();
    for (int i = 0; i < plan_.carriers(); ++i) {
        const double own_rad_s = carrier_rad_s(static_cast<std::size_t>(i));
        motion_lag_s_(i, i) = -1 / own_rad_s;
        for (int j = 0; j < plan_.carriers() && !plan_.is_tdm(); ++j) {
            const double other_rad_s = carrier_rad_s(static_cast<std::size_t>(j));
            double leakage_s = 0;
            for (int n = 0; n < plan_.window_samples; ++n) {
                const double time_s = (n - 0.5 * (plan_.window_samples - 1)) / plan_.params.sample_rate_hz;
                leakage_s += 2.0 / plan_.window_samples * time_s * std::sin(other_rad_s * time_s) * std::cos(own_rad_s * time_s);
            }
            const double induced_v = other_rad_s * world_.drive_amplitude(j);
            motion_lag_s_(j, i) += induced_v / (own_rad_s * world_.drive_amplitude(i)) * leakage_s;
        }
    }
}

double ColumnWorld::carrier_rad_s(std::size_t carrier) const { return 2 * std::numbers::pi * plan_.params.carrier_hz[carrier]; }

bool ColumnWorld::simulate(const Block& block, signal::Columns<double>& columns) {
    const FaultEffect effect = world_.effect_at(block.start_s);
    advance(block.start_s);
    const WindowCoupling coupling = window_coupling(effect, block.start_s);
    ChannelNoise noise;
    for (ColumnNoise::Phasors& phasors : noise) {
        phasors = noise_.draw(random_);
    }
    const bool saturated = saturates(block, coupling.mean, effect);
    columns = {};
    for (int n = 0; n < plan_.carriers(); ++n) {
        columns.push_back(make_column(block, n, coupling, effect, noise));
        columns[static_cast<std::size_t>(n)].flags.set_if(saturated, ColumnFlag::saturated);
    }
    return std::uniform_real_distribution<double>(0, 1)(drop_random_) >= effect.drop_share;
}

/// One evaluation of the motion per block if blocks follow each other.
void ColumnWorld::advance(double start_s) {
    const double block_s = plan_.block_s();
    const auto pose = [&](int n) { return world_.motion().at(start_s + middle_s_ + n * block_s); };
    const bool follows = std::abs(start_s - present_s_ - block_s) < 1e-9;
    poses_ = follows ? std::array{poses_[1], poses_[2], pose(1)} : std::array{pose(-1), pose(0), pose(1)};
    present_s_ = start_s;
}

/// The mean over a window of length tau is X + X'' tau^2 / 24.
ColumnWorld::WindowCoupling ColumnWorld::window_coupling(const FaultEffect& effect, double start_s) {
    const double block_s = plan_.block_s();
    const double share = plan_.window_s() / block_s;
    const Mat3<double> before = world_.coupling(poses_[0], effect);
    const Mat3<double> x = world_.coupling(poses_[1], effect);
    const Mat3<double> after = world_.coupling(poses_[2], effect);
    const Mat3<double> mean = x + share * share / 24 * (after - 2 * x + before);
    CurrentColumns with_metal = world_.metal_coupling(poses_[1], effect, start_s + middle_s_, start_s);
    for (Index n = 0; n < with_metal.cols(); ++n) {
        with_metal.col(n) += eigen(mean.col(n % kSourceCoils));
    }
    return {with_metal, (after - before) / (2 * block_s)};
}

/// Computes phasors of the channels, then the column as the demodulator does.
MeasuredColumn<double> ColumnWorld::make_column(const Block& block, int carrier_index, const WindowCoupling& coupling,
                                                const FaultEffect& effect, const ChannelNoise& noise) const {
    const auto carrier = static_cast<std::size_t>(carrier_index);
    const int current = plan_.is_tdm() ? coil_index(block.state) : carrier_index;
    const int coil = current % kSourceCoils;
    MeasuredColumn<double> column;
    column.state = single_coil(coil);
    column.state_sequence = block.sequence;
    column.sequence = block.sequence;
    column.midpoint = block.start + microseconds_from_seconds(middle_s_);

    column.flags.set_if(current >= kSourceCoils, ColumnFlag::low_band);
    const std::complex<double> current_v = world_.drive_amplitude(current) * effect.current(coil) * current_phase_[carrier];
    const std::complex<double> reference_v = current_v + sample_sigma_v_ * noise[kReferenceChannel][carrier];
    if (std::abs(reference_v) < demodulator_.min_reference_v) {
        column.flags.set(ColumnFlag::no_reference);
        column.sigma.setConstant(demodulator_.sigma_floor);
        return column;
    }
    const double amplitude_sigma = sample_sigma_v_ * std::sqrt(2.0 / plan_.window_samples) / std::abs(reference_v);
    for (Index c = 0; c < kSensorCoils; ++c) {
        const auto channel = static_cast<std::size_t>(c);
        const std::complex<double> response = demodulator_.response[carrier][channel];
        double by_motion = 0;
        for (int n = 0; n < plan_.carriers(); ++n) {
            const int other = plan_.is_tdm() ? coil : n % kSourceCoils;
            by_motion += motion_lag_s_(n, carrier_index) * coupling.rate(c, other) * effect.current(other) / effect.current(coil);
        }
        const std::complex<double> x = coupling.mean(c, current) + std::complex<double>(0, by_motion);
        const std::complex<double> sensor_v = x * response * current_v + sample_sigma_v_ * noise[channel][carrier];
        const std::complex<double> ratio = sensor_v / reference_v;
        column.in_phase(c) = (ratio / response).real();
        column.quadrature(c) = (ratio / response).imag();
        column.sigma(c) =
            std::max(demodulator_.sigma_floor, amplitude_sigma * std::sqrt(1 + std::norm(ratio)) / std::abs(response));
    }
    column.flags.set_if(column.in_phase.norm() < demodulator_.low_signal_ratio * column.sigma.maxCoeff(), ColumnFlag::low_signal);
    return column;
}

/// True if the carriers of a sensor channel exceed its linear range where their peaks coincide.
bool ColumnWorld::saturates(const Block& block, const CurrentColumns& coupling, const FaultEffect& effect) const {
    Vec3<double> peak_v = Vec3<double>::Zero();
    for (int n = 0; n < plan_.carriers(); ++n) {
        const int current = plan_.is_tdm() ? coil_index(block.state) : n;
        for (Index c = 0; c < kSensorCoils; ++c) {
            const std::complex<double> response = demodulator_.response[static_cast<std::size_t>(n)][static_cast<std::size_t>(c)];
            const double amplitude_v = world_.drive_amplitude(current) * effect.current(current % kSourceCoils);
            peak_v(c) += std::abs(coupling(c, current) * response) * amplitude_v;
        }
    }
    return peak_v.maxCoeff() >= static_cast<double>(demodulator_.linear_share) * world_.params().converter.range_v;
}

}  // namespace tricoil::sim

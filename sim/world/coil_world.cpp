#include "sim/world/coil_world.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "core/geometry/angles.hpp"
#include "core/linear/eigen.hpp"
#include "sim/world/pose_track.hpp"

namespace tricoil::sim {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kReferenceRadS =
    kTurn * 10e3;  // couplings are defined at 10 kHz, because a coil's voltage grows with the frequency

/// (3 r r^T / |r|^2 - I) / (2 |r|^3): the dipole field per unit moment. C times it is X of an unrotated sensor, (6).
Mat3<double> dipole_field(const Vec3<double>& r) {
    const double squared = r.squaredNorm();
    const double inverse_cube = 1 / (squared * std::sqrt(squared));
    return inverse_cube * (1.5 / squared * r * r.transpose() - 0.5 * Mat3<double>::Identity());
}

double mains_shape(double phase_rad) { return std::sin(phase_rad) + std::sin(3 * phase_rad) / 3 + std::sin(5 * phase_rad) / 5; }

void require(bool ok, const char* what) {
    if (!ok) {
        throw std::invalid_argument(std::string("world: ") + what);
    }
}

}  // namespace

void check(const WorldParams& p) {
    const auto positive = [](double value) { return std::isfinite(value) && value > 0; };
    const auto not_negative = [](double value) { return std::isfinite(value) && value >= 0; };
    require(positive(p.coupling_constant_m3), "coupling constant must be positive");
    require(positive(p.coil_resistance_ohm) && positive(p.coil_inductance_h), "coil resistance and inductance must be positive");
    require(p.converter.bits >= 8 && p.converter.bits <= 31, "converter bits must be 8 to 31");
    require(positive(p.converter.range_v) && positive(p.converter.rail_v), "converter range and rail must be positive");
    require(not_negative(p.converter.noise_v_per_sqrt_hz) && not_negative(p.mains_v), "noise and mains must not be negative");
    require(positive(p.mains_hz), "mains frequency must be positive");
    require(std::abs(p.source_matrix.determinant()) > 1e-3, "source matrix must not be singular");
    require(std::abs(p.sensor_matrix.determinant()) > 1e-3, "sensor matrix must not be singular");
}

CoilWorld::CoilWorld(const WorldParams& params, const Motion& motion, std::vector<Fault> faults)
    : params_(params),
      motion_(motion),
      faults_(std::move(faults)),
      metal_(metal_of(faults_)),
      random_(params.seed),
      drop_random_(params.seed + 1) {
    check(params_);
    for (std::size_t c = 0; c < kSensorCoils; ++c) {
        channel_[c] = std::polar(params_.channel_gain[c], params_.channel_phase_rad[c]);
    }
}

void CoilWorld::configure(const signal::AcquisitionPlan& plan) {
    plan_ = plan;
    end_s_ = -std::numeric_limits<double>::infinity();
    tune_metal();
    const double rate = plan.params.sample_rate_hz;
    const double middle_s = (plan.params.guard_samples + 0.5 * (plan.window_samples - 1)) / rate;
    const double time_constant_s = params_.coil_inductance_h / params_.coil_resistance_ohm;
    for (std::size_t n = 0; n < currents(); ++n) {
        const double carrier = kTurn * plan.params.carrier_hz[n];
        const double phase = -carrier * middle_s;
        const double amplitude = drive_amplitude(static_cast<int>(n));
        circuits_[n] = CoilCircuit(amplitude, carrier, phase, time_constant_s, kReferenceRadS);
    }
    converters_.assign(kChannels, Converter(params_.converter, rate));
    mains_.clear();
    const double period = rate / params_.mains_hz;
    if (std::abs(period - std::round(period)) < 1e-9) {
        for (int n = 0; n < static_cast<int>(std::lround(period)); ++n) {
            mains_.push_back(params_.mains_v * mains_shape(kTurn * n / period));
        }
    }
}

MetalSet CoilWorld::metal_of(const std::vector<Fault>& faults) {
    MetalSet metal;
    for (const Fault& fault : faults) {
        if (fault.metal) {
            metal.add(*fault.metal, fault.begin_s, fault.end_s);
        }
    }
    return metal;
}

void CoilWorld::tune_metal() {
    std::vector<double> frequencies_hz;
    for (std::size_t n = 0; n < currents(); ++n) {
        const auto found = std::find(frequencies_hz.begin(), frequencies_hz.end(), plan_.params.carrier_hz[n]);
        metal_frequencies_[n] = static_cast<std::size_t>(found - frequencies_hz.begin());
        if (found == frequencies_hz.end()) {
            frequencies_hz.push_back(plan_.params.carrier_hz[n]);
        }
    }
    metal_.tune(frequencies_hz);
}

std::optional<MetalTrack> CoilWorld::metal_track(const FaultEffect& effect, double start_s, std::size_t samples) {
    if (effect.unplugged || !metal_.acts_at(start_s)) {
        return std::nullopt;
    }
    return MetalTrack(metal_, motion_, metal_source(effect), start_s, 1 / plan_.params.sample_rate_hz, samples);
}

CurrentColumns CoilWorld::metal_coupling(const Pose& pose, const FaultEffect& effect, double time_s, double selection_s) {
    if (effect.unplugged || !metal_.acts_at(selection_s)) {
        return CurrentColumns::Zero(3, static_cast<Index>(currents()));
    }
    return eigen(sensor_side(pose, effect)) * metal_field(metal_, metal_source(effect), pose.position_m, time_s, selection_s);
}

/// Couplings at one sample, and their change since the sample before. Without metal both bands have the same.
struct CoilWorld::Couplings {
    Mat3<double> x;
    Mat3<double> dx;       // rate of change divided by the reference angular frequency
    CurrentColumns metal;  // no columns: no metal
    CurrentColumns metal_change;
};

bool CoilWorld::sample(Excitation state, double start_s, std::span<Sample> samples) {
    const FaultEffect effect = effect_at(start_s);
    const double sample_s = 1 / plan_.params.sample_rate_hz;
    if (start_s > end_s_ + sample_s) {
        drive_start_s_ = start_s;
        for (CoilCircuit& circuit : circuits_) {
            circuit.rest();
        }
    }
    end_s_ = start_s + static_cast<double>(samples.size()) * sample_s;
    for (std::size_t n = 0; n < currents(); ++n) {
        const auto coil = static_cast<int>(n % kSourceCoils);
        const bool on = (state == Excitation::all || coil_index(state) == coil) && effect.current(coil) > 0;
        circuits_[n].begin_block(start_s - drive_start_s_, sample_s, on);
    }
    PoseTrack track(motion_, start_s, sample_s);
    const std::optional<MetalTrack> metal = metal_track(effect, start_s, samples.size());
    const auto with_metal = [&](const Pose& pose, int n) -> CurrentColumns {
        return eigen(sensor_side(pose, effect)) * metal->at(n);
    };
    const double per_sample = 1 / (sample_s * kReferenceRadS);
    const Pose first = track.at(-1);
    Couplings now;
    now.x = coupling(first, effect);
    if (metal) {
        now.metal = with_metal(first, -1);
    }
    std::array<CoilCurrent, kMaxCarriers> source{};
    for (std::size_t n = 0; n < samples.size(); ++n) {
        const Pose pose = track.at(static_cast<int>(n));
        const Mat3<double> x = coupling(pose, effect);
        now.dx = (x - now.x) * per_sample;
        now.x = x;
        if (metal) {
            const CurrentColumns added = with_metal(pose, static_cast<int>(n));
            now.metal_change = (added - now.metal) * per_sample;
            now.metal = added;
        }
        double reference_v = 0;
        for (std::size_t k = 0; k < currents(); ++k) {
            source[k] = circuits_[k].next();
            // 1 for an open coil: its circuit is off
            const double share = std::max(1.0, effect.current(static_cast<Index>(k % kSourceCoils)));
            source[k].current *= share;
            source[k].derivative *= share;
            reference_v += source[k].current.real();
        }
        const Vec3<double> sensor_v = sensor_voltages(now, std::span(source).first(currents()));
        const double time_s = start_s + static_cast<double>(n) * sample_s;
        samples[n] = convert(sensor_v, reference_v, time_s, effect);
    }
    return std::uniform_real_distribution<double>(0, 1)(drop_random_) >= effect.drop_share;
}

void CoilWorld::amplify(const signal::GainStep<double>& amplifier) {
    amplifier_ = amplifier;
    for (std::size_t n = 0; n < currents(); ++n) {
        for (std::size_t c = 0; c < kSensorCoils; ++c) {
            amplification_[n][c] = amplifier.response(c, kTurn * plan_.params.carrier_hz[n]);
        }
    }
}

/// Induction is the derivative of (coupling times current); motion adds a small voltage. The response of an amplifier differs
/// between the carriers.
Vec3<double> CoilWorld::sensor_voltages(const Couplings& now, std::span<const CoilCurrent> currents) const {
    Vec3<std::complex<double>> sum = Vec3<std::complex<double>>::Zero();
    for (std::size_t n = 0; n < currents.size(); ++n) {
        const auto column = static_cast<Index>(n);
        const auto coil = static_cast<Index>(n % kSourceCoils);
        const auto& [current, derivative] = currents[n];
        Vec3<std::complex<double>> induced =
            now.x.col(coil).cast<std::complex<double>>() * derivative + now.dx.col(coil).cast<std::complex<double>>() * current;
        if (now.metal.cols() > 0) {
            induced += Vec3<std::complex<double>>(now.metal.col(column) * derivative + now.metal_change.col(column) * current);
        }
        for (Index c = 0; c < kSensorCoils; ++c) {
            sum(c) += amplifier_ ? amplification_[n][static_cast<std::size_t>(c)] * induced(c) : induced(c);
        }
    }
    Vec3<double> volts;
    for (Index c = 0; c < kSensorCoils; ++c) {
        volts(c) = (channel_[static_cast<std::size_t>(c)] * sum(c)).real();
    }
    return volts;
}

Sample CoilWorld::convert(const Vec3<double>& sensor_v, double reference_v, double time_s, const FaultEffect& effect) {
    double mains = 0;
    if (params_.mains_v > 0) {
        const auto n = static_cast<std::size_t>(std::llround(time_s * plan_.params.sample_rate_hz));
        mains = mains_.empty() ? params_.mains_v * mains_shape(kTurn * params_.mains_hz * time_s) : mains_[n % mains_.size()];
    }
    mains += effect.overload_ranges * params_.converter.range_v * std::sin(kTurn * params_.mains_hz * time_s);
    Sample sample;
    for (std::size_t c = 0; c < kChannels; ++c) {
        const double hum = amplifier_ && c != kReferenceChannel ? amplifier_->gain[c] * mains : mains;
        const double volts = c == kReferenceChannel ? reference_v : sensor_v(static_cast<Index>(c)) + hum;
        const std::int32_t code = converters_[c].convert(volts, random_);
        sample[c] = effect.stuck[c] ? 0 : code;
    }
    return sample;
}

Mat3<double> CoilWorld::coupling(const Pose& pose) const { return coupling(pose, FaultEffect{}); }

Mat3<double> CoilWorld::coupling(const Pose& pose, const FaultEffect& effect) const {
    if (effect.unplugged) {
        return params_.crosstalk * Mat3<double>::Ones();
    }
    const Mat3<double> field = dipole_field(pose.position_m);
    const Mat3<double> o = geometry::attitude_matrix(pose.q_source_sensor);
    const Mat3<double> by_field = params_.coupling_constant_m3 * effect.sensor * params_.sensor_matrix * o * field;
    return (by_field * params_.source_matrix + params_.pick_up) * effect.source;
}

Mat3<double> CoilWorld::sensor_side(const Pose& pose, const FaultEffect& effect) const {
    if (effect.unplugged) {
        return Mat3<double>::Zero();
    }
    return 0.5 * params_.coupling_constant_m3 * effect.sensor * params_.sensor_matrix *
           geometry::attitude_matrix(pose.q_source_sensor);
}

double CoilWorld::drive_amplitude(int n) const {
    constexpr double kHighVoltHertz = 0.5 * 10e3;
    constexpr double kLowVoltHertz = 0.25 * 720;
    const double carrier_hz = plan_.params.carrier_hz[static_cast<std::size_t>(n)];
    return plan_.is_tdm() ? 1.0 : (n < kSourceCoils ? kHighVoltHertz : kLowVoltHertz) / carrier_hz;
}

signal::ChannelResponse<double> CoilWorld::channel_response() const {
    auto response = signal::unit_response<double>();
    for (std::size_t n = 0; n < currents(); ++n) {
        const double ratio = kTurn * plan_.params.carrier_hz[n] / kReferenceRadS;
        for (std::size_t c = 0; c < kSensorCoils; ++c) {
            response[n][c] = std::complex<double>(0, ratio) * channel_[c];
        }
    }
    return response;
}

signal::DemodulatorParams<double> CoilWorld::demodulation() const {
    constexpr double kBelowRail = 0.99;  // noise around the rail still counts as clipped
    signal::DemodulatorParams<double> params;
    params.response = channel_response();
    params.sigma_floor = volts_per_code() / std::sqrt(12.0) * std::sqrt(2.0 / plan_.window_samples);
    params.linear_share = static_cast<float>(std::min(1.0, kBelowRail * params_.converter.rail_v / params_.converter.range_v));
    return params;
}

double CoilWorld::sample_sigma_v() const {
    const double quantisation = volts_per_code() / std::sqrt(12.0);
    return std::hypot(converters_.front().noise_v(), quantisation);
}

/// Amplitude of the first carrier at the first converter, for a coupling of 1.
double CoilWorld::volts_per_coupling() const {
    const double ratio = kTurn * plan_.params.carrier_hz[0] / kReferenceRadS;
    return drive_amplitude(0) * ratio * std::abs(channel_[0]);
}

double CoilWorld::coupling_sigma() const {
    return sample_sigma_v() * std::sqrt(2.0 / plan_.window_samples) / volts_per_coupling();
}

}  // namespace tricoil::sim

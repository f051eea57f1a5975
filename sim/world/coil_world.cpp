#include "sim/world/coil_world.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/geometry/angles.hpp"
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

constexpr double kLowAmplitude_v_hz = 0.4 * 480;  // amplitude times frequency of the low tones

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
    tune_metal();
    const double rate = plan.params.sample_rate_hz;
    const double middle_s = (plan.params.guard_samples + 0.5 * (plan.window_samples - 1)) / rate;
    const double time_constant_s = params_.coil_inductance_h / params_.coil_resistance_ohm;
    for (int j = 0; j < kSourceCoils; ++j) {
        const double carrier = kTurn * plan.params.carrier_hz[static_cast<std::size_t>(j)];
        const double phase = -carrier * middle_s;
        circuits_[static_cast<std::size_t>(j)] = CoilCircuit(drive_amplitude(j), carrier, phase, time_constant_s, kReferenceRadS);
    }
    for (std::size_t j = 0; low_band_ && j < kSourceCoils; ++j) {
        const double tone = kTurn * low_band_->tone_hz(j);
        low_circuits_[j] =
            CoilCircuit(kLowAmplitude_v_hz / low_band_->tone_hz(j), tone, -tone * middle_s, time_constant_s, kReferenceRadS);
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
    std::vector<double> tones_hz;
    const auto index_of = [&tones_hz](double hz) {
        const auto tone = std::find(tones_hz.begin(), tones_hz.end(), hz);
        const auto index = static_cast<std::size_t>(tone - tones_hz.begin());
        if (tone == tones_hz.end()) {
            tones_hz.push_back(hz);
        }
        return index;
    };
    for (std::size_t j = 0; j < kSourceCoils; ++j) {
        tone_of_coil_[j] = index_of(plan_.params.carrier_hz[j]);
    }
    for (std::size_t j = 0; low_band_ && j < kSourceCoils; ++j) {
        tone_of_low_tone_[j] = index_of(low_band_->tone_hz(j));
    }
    metal_.tune(tones_hz);
}

std::optional<MetalTrack> CoilWorld::metal_track(const FaultEffect& effect, double start_s, std::size_t samples) {
    if (effect.unplugged || !metal_.acts_at(start_s)) {
        return std::nullopt;
    }
    const std::array bands{metal_source(effect), low_metal_source(effect)};
    return MetalTrack(metal_, motion_, std::span(bands).first(low_band_ ? 2 : 1), start_s, 1 / plan_.params.sample_rate_hz,
                      samples);
}

ComplexMat3 CoilWorld::metal_coupling(const Pose& pose, const FaultEffect& effect, double time_s, double selection_s) {
    if (effect.unplugged || !metal_.acts_at(selection_s)) {
        return ComplexMat3::Zero();
    }
    return sensor_side(pose, effect) * metal_field(metal_, metal_source(effect), pose.position_m, time_s, selection_s);
}

CoilWorld::Currents CoilWorld::next_currents(Circuits& circuits, const FaultEffect& effect) {
    Currents now;
    for (Eigen::Index j = 0; j < kSourceCoils; ++j) {
        const CoilCurrent coil = circuits[static_cast<std::size_t>(j)].next();
        const double share = std::max(1.0, effect.current(j));  // 1 for an open coil: its circuit is off
        now.current(j) = share * coil.current;
        now.derivative(j) = share * coil.derivative;
    }
    return now;
}

bool CoilWorld::sample(Excitation state, double start_s, std::span<Sample> samples) {
    const FaultEffect effect = effect_at(start_s);
    const double sample_s = 1 / plan_.params.sample_rate_hz;
    const std::size_t bands = low_band_ ? 2 : 1;
    const std::array<Circuits*, 2> circuits{&circuits_, &low_circuits_};
    for (std::size_t band = 0; band < bands; ++band) {
        for (int j = 0; j < kSourceCoils; ++j) {
            const bool on = (state == Excitation::all || coil_index(state) == j) && effect.current(j) > 0;
            (*circuits[band])[static_cast<std::size_t>(j)].begin_block(start_s, sample_s, on);
        }
    }
    PoseTrack track(motion_, start_s, sample_s);
    const std::optional<MetalTrack> metal = metal_track(effect, start_s, samples.size());
    const auto with_metal = [&](const Pose& pose, const Mat3<double>& x, int n, std::size_t band) -> ComplexMat3 {
        return x + sensor_side(pose, effect) * metal->at(n, band);
    };
    const Pose first = track.at(-1);
    Mat3<double> before = coupling(first, effect);
    std::array<ComplexMat3, 2> before_with_metal;
    for (std::size_t band = 0; metal && band < bands; ++band) {
        before_with_metal[band] = with_metal(first, before, -1, band);
    }
    const double per_sample = 1 / (sample_s * kReferenceRadS);
    for (std::size_t n = 0; n < samples.size(); ++n) {
        const Pose pose = track.at(static_cast<int>(n));
        const Mat3<double> x = coupling(pose, effect);
        const Mat3<double> change = (x - before) / (sample_s * kReferenceRadS);
        Vec3<double> sensor_v = Vec3<double>::Zero();
        double reference_v = 0;
        for (std::size_t band = 0; band < bands; ++band) {
            const Currents currents = next_currents(*circuits[band], effect);
            reference_v += currents.current.sum().real();
            if (metal) {
                const ComplexMat3 now = with_metal(pose, x, static_cast<int>(n), band);
                const ComplexMat3 change_with_metal = (now - before_with_metal[band]) * per_sample;
                sensor_v += sensor_voltages(now, change_with_metal, currents);
                before_with_metal[band] = now;
            } else {
                sensor_v += sensor_voltages(x, change, currents);
            }
        }
        before = x;
        const double time_s = start_s + static_cast<double>(n) * sample_s;
        samples[n] = convert(sensor_v, reference_v, time_s, effect);
    }
    return std::uniform_real_distribution<double>(0, 1)(drop_random_) >= effect.drop_share;
}

void CoilWorld::amplify(const signal::GainStep<double>& amplifier) {
    amplifier_ = amplifier;
    for (std::size_t j = 0; j < kSourceCoils; ++j) {
        for (std::size_t c = 0; c < kSensorCoils; ++c) {
            amplification_[j][c] = amplifier.response(c, kTurn * plan_.params.carrier_hz[j]);
        }
    }
}

/// Induction is the derivative of (coupling times current); motion adds a small voltage. `dx`: the rate of change of `x` divided
/// by the reference angular frequency. The response of an amplifier differs between the carriers.
template <typename Matrix>
Vec3<double> CoilWorld::sensor_voltages(const Matrix& x, const Matrix& dx, const Currents& currents) const {
    const auto& [current, derivative] = currents;
    Vec3<std::complex<double>> sum = Vec3<std::complex<double>>::Zero();
    if (amplifier_) {
        for (Eigen::Index j = 0; j < kSourceCoils; ++j) {
            for (Eigen::Index c = 0; c < kSensorCoils; ++c) {
                sum(c) += amplification_[static_cast<std::size_t>(j)][static_cast<std::size_t>(c)] *
                          (x(c, j) * derivative(j) + dx(c, j) * current(j));
            }
        }
    } else {
        sum = x * derivative + dx * current;
    }
    Vec3<double> volts;
    for (Eigen::Index c = 0; c < kSensorCoils; ++c) {
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
        const double volts = c == kReferenceChannel ? reference_v : sensor_v(static_cast<Eigen::Index>(c)) + hum;
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
    return params_.coupling_constant_m3 * effect.sensor * params_.sensor_matrix * o * field * params_.source_matrix *
           effect.source;
}

Mat3<double> CoilWorld::sensor_side(const Pose& pose, const FaultEffect& effect) const {
    if (effect.unplugged) {
        return Mat3<double>::Zero();
    }
    return 0.5 * params_.coupling_constant_m3 * effect.sensor * params_.sensor_matrix *
           geometry::attitude_matrix(pose.q_source_sensor);
}

double CoilWorld::drive_amplitude(int j) const {
    return plan_.is_tdm() ? 1.0 : 0.5 * kReferenceRadS / (kTurn * plan_.params.carrier_hz[static_cast<std::size_t>(j)]);
}

signal::ChannelResponse<double> CoilWorld::channel_response() const {
    auto response = signal::unit_response<double>();
    for (std::size_t j = 0; j < kSourceCoils; ++j) {
        const double ratio = kTurn * plan_.params.carrier_hz[j] / kReferenceRadS;
        for (std::size_t c = 0; c < kSensorCoils; ++c) {
            response[j][c] = std::complex<double>(0, ratio) * channel_[c];
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

signal::LowBandParams CoilWorld::low_band_demodulation() const {
    signal::LowBandParams params;
    params.plan = *low_band_;
    for (std::size_t j = 0; j < kSourceCoils; ++j) {
        for (std::size_t c = 0; c < kSensorCoils; ++c) {
            params.response[j][c] = std::complex<double>(0, kTurn * low_band_->tone_hz(j) / kReferenceRadS) * channel_[c];
        }
    }
    return params;
}

double CoilWorld::sample_sigma_v() const {
    const double quantisation = volts_per_code() / std::sqrt(12.0);
    return std::hypot(converters_.front().noise_v(), quantisation);
}

double CoilWorld::coupling_sigma() const {
    const double ratio = kTurn * plan_.params.carrier_hz[0] / kReferenceRadS;
    return sample_sigma_v() * std::sqrt(2.0 / plan_.window_samples) / (drive_amplitude(0) * ratio * std::abs(channel_[0]));
}

}  // namespace tricoil::sim

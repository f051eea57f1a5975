#include "board/host/capture/capture_analysis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "board/host/capture/tone_fit.hpp"
#include "board/support/errors.hpp"
#include "core/base/angle_units.hpp"
#include "core/linear/eigen.hpp"
#include "core/signal/block_health.hpp"
#include "core/solver/direct.hpp"
#include "core/tracking/tracker_params.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

using Complex = std::complex<double>;

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kNyquistShare = 0.9;  // highest carrier, of half the sample rate
constexpr double kMinPeriods = 2;      // of the smallest difference of frequencies, in a block
constexpr double kDefaultPeriods = 4;
constexpr double kLongestBlock = 10'000'000;
constexpr double kMostOffset_ppm = 10'000;
constexpr double kMinCarrierRatio = 6;      // amplitude of a carrier over its standard deviation
constexpr double kMinReferenceRatio = 1.5;  // in every block, reference amplitude over that of the largest other channel
constexpr double kSteadyRatio = 1.1;        // strongest block over weakest, of the reference to coils in turn
constexpr double kUnsteadyRatio = 1.3;      // the same, of every sensor channel
constexpr double kMinReferenceShare = 0.5;  // of its mean amplitude; a weaker reference dropped out
constexpr double kSetup_s = 1;              // signal that gives frequencies, reference, phases and signs
constexpr int kSetupBlocks = 12;            // of each coil
constexpr int kFlagRange = 1'000'000;       // full scale of the codes for inspect_window

struct Repeat {
    Mat3<Complex> columns;
    int coils = 0;     // bits
    double begin = 0;  // samples
    double end = 0;
    double variance = 0;  // of a coupling
};

class Analyser {
public:
    /// Throws for carriers that do not suit the rate, the blocks, or each other.
    Analyser(CaptureReader& capture, const CaptureParams& params, const std::function<void(const CaptureRow&)>& put);
    CaptureAnalysis run();

private:
    bool read(CapturedBlock& block);
    std::vector<CapturedBlock> read_setup();
    void estimate_frequencies(const std::vector<CapturedBlock>& blocks);
    [[nodiscard]] Tones tones_of(const CapturedBlock& block) const;
    [[nodiscard]] ColumnFlags flags_of(const CapturedBlock& block) const;
    void check_signal(const std::vector<Tones>& tones) const;
    [[nodiscard]] int found_reference(const std::vector<Tones>& tones) const;
    void choose_channels(const std::vector<Tones>& tones);
    void find_phases(const std::vector<CapturedBlock>& blocks, const std::vector<Tones>& tones);
    void for_each_column(const CapturedBlock& block, const Tones& tones, const auto& use);
    void add(const CapturedBlock& block, const Tones& tones);
    void end_repeat(const Repeat& repeat);

    [[nodiscard]] std::span<const double> window(const CapturedBlock& block, std::size_t from = 0) const {
        return std::span(block.values).subspan((params_.guard_samples + from) * channels_);
    }

    CaptureReader& capture_;
    CaptureParams params_;
    const std::function<void(const CaptureRow&)>& put_;
    CaptureAnalysis result_;
    std::size_t channels_;
    std::size_t samples_ = 0;  // of a block, without its guard
    std::vector<double> w_;    // of the carriers, radians per sample
    std::size_t clipped_ = 0;  // blocks
    std::optional<ToneFit> fit_;
    Eigen::VectorXd reference_;                          // mean amplitude, by tone; 1 without a reference
    Mat3<Complex> phases_ = Mat3<Complex>::Constant(1);  // unit phasors, by sensor channel and tone
    Mat3<Complex> columns_ = Mat3<Complex>::Zero();      // the last of each coil
    double sign_ = 1;
    std::map<int, Repeat> repeats_;  // not yet complete
    Mat3<double> last_x_;
    Mat3<double> squares_ = Mat3<double>::Zero();  // of the differences of successive repeats
};

Analyser::Analyser(CaptureReader& capture, const CaptureParams& params, const std::function<void(const CaptureRow&)>& put)
    : capture_(capture), params_(params), put_(put), channels_(capture.channels().size()) {
    const double rate_hz = params.rate_hz != 0 ? params.rate_hz : capture.rate_hz();
    const std::size_t needed = capture.has_states() ? 1 : kSourceCoils;
    refuse_if(!(rate_hz > 0) || !std::isfinite(rate_hz), "--rate-hz {}: give the sample rate, more than 0", params.rate_hz);
    refuse_if(
        params.carrier_hz.size() != needed,
        "{}: {} carriers; with the columns state, repeat and sample the coils are driven in turn, at one carrier, otherwise at "
        "the same time, at three",
        capture.path(), params.carrier_hz.size());
    double apart_hz = rate_hz / 2;
    for (std::size_t k = 0; k < needed; ++k) {
        const double carrier_hz = params.carrier_hz[k];
        refuse_if(!(carrier_hz > 0 && carrier_hz <= kNyquistShare * rate_hz / 2),
                  "--carrier-hz {}: must be more than 0, and at most {:g} Hz, {:g} of the Nyquist frequency, or it aliases",
                  carrier_hz, kNyquistShare * rate_hz / 2, kNyquistShare);
        w_.push_back(kTurn * carrier_hz / rate_hz);
        apart_hz = std::min({apart_hz, carrier_hz, rate_hz / 2 - carrier_hz});
        for (std::size_t other = 0; other < k; ++other) {
            apart_hz = std::min(apart_hz, std::abs(carrier_hz - params.carrier_hz[other]));
        }
    }
    const auto samples_for = [&](double periods) { return std::ceil(periods * rate_hz / std::max(apart_hz, 1e-9 * rate_hz)); };
    const double block = params.block_samples != 0 ? static_cast<double>(params.block_samples) : samples_for(kDefaultPeriods);
    refuse_if(!capture.has_states() && (block < samples_for(kMinPeriods) || block > kLongestBlock),
              "--carrier-hz: two frequencies are only {:g} Hz apart; blocks of {} samples cannot separate them, {} or more can",
              apart_hz, block, samples_for(kMinPeriods));
    result_.rate_hz = rate_hz;
    result_.block_samples = static_cast<std::size_t>(std::min(block, kLongestBlock));
}

bool Analyser::read(CapturedBlock& block) {
    if (!capture_.next(block, result_.block_samples)) {
        return false;
    }
    const std::size_t length = block.values.size() / channels_;
    const std::size_t needed = params_.guard_samples + 2 * (2 * w_.size() + 2);
    refuse_if(length < needed, "{}: blocks of {} samples; with --guard {} at least {} are needed", capture_.path(), length,
              params_.guard_samples, needed);
    samples_ = length - params_.guard_samples;
    result_.block_samples = length;
    const ColumnFlags flags = flags_of(block);
    clipped_ += flags.has(ColumnFlag::saturated) || flags.has(ColumnFlag::clipped) ? 1 : 0;
    result_.flags |= flags;
    return true;
}

std::vector<CapturedBlock> Analyser::read_setup() {
    std::vector<CapturedBlock> blocks;
    std::array<int, kSourceCoils> count{};
    const auto is_enough = [&] {
        return *std::ranges::min_element(count) >= kSetupBlocks &&
               static_cast<double>(blocks.size() * result_.block_samples) >= kSetup_s * result_.rate_hz;
    };
    for (CapturedBlock block; !is_enough() && read(block);) {
        for (int j = 0; j < kSourceCoils; ++j) {
            count[static_cast<std::size_t>(j)] += block.drives(j) ? 1 : 0;
        }
        blocks.push_back(block);
    }
    refuse_if(blocks.empty(), "{}: holds no samples, or fewer than a block of {}", capture_.path(), result_.block_samples);
    refuse_if(clipped_ == blocks.size(), "{}: every block is clipped; reduce the gain", capture_.path());
    return blocks;
}

void Analyser::estimate_frequencies(const std::vector<CapturedBlock>& blocks) {
    const std::size_t half = samples_ / 2;
    for (int pass = 0; pass < 3; ++pass) {
        const ToneFit fit(w_, half);
        Eigen::VectorXcd advance = Eigen::VectorXcd::Zero(static_cast<Index>(w_.size()));  // of the phase, in half a block
        for (const CapturedBlock& block : blocks) {
            const Tones first = fit.fit(window(block), channels_);
            const Tones second = fit.fit(window(block, half), channels_);
            advance += first.amplitude.conjugate().cwiseProduct(second.amplitude).colwise().sum().transpose();
        }
        for (std::size_t k = 0; k < w_.size(); ++k) {
            const auto n = static_cast<double>(half);
            const double given = kTurn * params_.carrier_hz[k] / result_.rate_hz;
            const double change = std::arg(advance(static_cast<Index>(k)) * std::polar(1.0, -w_[k] * n)) / n;
            w_[k] = std::clamp(w_[k] + change, (1 - 2e-6 * kMostOffset_ppm) * given, (1 + 2e-6 * kMostOffset_ppm) * given);
        }
    }
    for (std::size_t k = 0; k < w_.size(); ++k) {
        result_.carrier_hz.push_back(w_[k] / kTurn * result_.rate_hz);
        result_.offset_ppm.push_back(1e6 * (result_.carrier_hz[k] / params_.carrier_hz[k] - 1));
    }
    fit_.emplace(w_, samples_);
}

/// Of coils at the same time: with the phases at the first sample of the capture.
Tones Analyser::tones_of(const CapturedBlock& block) const {
    Tones tones = fit_->fit(window(block), channels_);
    for (std::size_t k = 0; k < w_.size() && !capture_.has_states(); ++k) {
        const double phase = std::fmod(w_[k] * static_cast<double>(block.begin + params_.guard_samples), kTurn);
        tones.amplitude.col(static_cast<Index>(k)) *= std::polar(1.0, -phase);
    }
    return tones;
}

ColumnFlags Analyser::flags_of(const CapturedBlock& block) const {
    const std::span<const double> values = window(block);
    const bool is_known = capture_.full_scale() > 0;
    const auto [low, high] = std::ranges::minmax(values);
    const double full_scale = is_known ? capture_.full_scale() : std::max({-low, high, 1e-300});
    std::vector<Sample> codes(samples_);
    for (std::size_t n = 0; n < samples_ * channels_; ++n) {
        codes[n / channels_][n % channels_] =
            static_cast<std::int32_t>(kFlagRange * std::clamp(values[n] / full_scale, -2.0, 2.0));
    }
    std::vector<int> cycles;
    for (const double w : w_) {
        cycles.push_back(std::max(1, static_cast<int>(w / kTurn * static_cast<double>(samples_))));
    }
    const int natural_run = signal::longest_natural_run(cycles, static_cast<int>(samples_));
    return signal::inspect_window(codes, natural_run, is_known ? kFlagRange : 0);
}

void Analyser::check_signal(const std::vector<Tones>& tones) const {
    Eigen::MatrixXd power = Eigen::MatrixXd::Zero(static_cast<Index>(channels_), static_cast<Index>(w_.size()));
    Eigen::VectorXd noise = Eigen::VectorXd::Constant(static_cast<Index>(channels_), 1e-300);
    for (const Tones& block : tones) {
        power += block.amplitude.cwiseAbs2();
        noise += 2 / static_cast<double>(samples_) * block.noise.cwiseAbs2();
    }
    for (std::size_t k = 0; k < w_.size(); ++k) {
        const double ratio = power.col(static_cast<Index>(k)).cwiseQuotient(noise).maxCoeff();
        refuse_if(!(ratio >= kMinCarrierRatio * kMinCarrierRatio),
                  "{}: no channel has a carrier of {:g} Hz: silence, or a wrong --carrier-hz or --rate-hz", capture_.path(),
                  params_.carrier_hz[k]);
        refuse_if(!(std::abs(result_.offset_ppm[k]) <= kMostOffset_ppm),
                  "{}: the carrier of {:g} Hz is {:.0f} ppm off, more than {:g}; correct --carrier-hz or --rate-hz",
                  capture_.path(), params_.carrier_hz[k], result_.offset_ppm[k], kMostOffset_ppm);
    }
}

/// The channel that is much larger than the others in every block, or alone the same for all coils.
int Analyser::found_reference(const std::vector<Tones>& tones) const {
    Eigen::ArrayXd weakest = Eigen::ArrayXd::Constant(static_cast<Index>(channels_), 1e300);
    Eigen::ArrayXd strongest = Eigen::ArrayXd::Zero(static_cast<Index>(channels_));
    for (const Tones& block : tones) {
        const Eigen::ArrayXXd amplitude = block.amplitude.cwiseAbs().array();
        weakest = weakest.min(amplitude.rowwise().minCoeff());
        strongest = strongest.max(amplitude.rowwise().maxCoeff());
    }
    for (Index c = 0; c < weakest.size(); ++c) {
        Eigen::ArrayXd others = strongest;
        others(c) = 0;
        Eigen::ArrayXd change = strongest / weakest.max(1e-300);
        const bool is_steady = capture_.has_states() && change(c) < kSteadyRatio;
        change(c) = kUnsteadyRatio;
        if (weakest(c) >= kMinReferenceRatio * others.maxCoeff() || (is_steady && change.minCoeff() >= kUnsteadyRatio)) {
            return static_cast<int>(c);
        }
    }
    throw InputError(
        capture_.path() +
        ": cannot identify the reference channel: no carrier is much larger than the others in every block, or alone equal "
        "for all coils; name it with --reference");
}

void Analyser::choose_channels(const std::vector<Tones>& tones) {
    if (params_.reference != "none" && !params_.reference.empty()) {
        result_.reference_channel = static_cast<int>(capture_.channel_of(params_.reference));
    } else if (params_.reference.empty() && channels_ > kSensorCoils) {
        result_.reference_channel = found_reference(tones);
    }
    for (int c = 0; c < static_cast<int>(channels_); ++c) {
        if (c != result_.reference_channel) {
            result_.sensor_channels.push_back(c);
        }
    }
    refuse_if(result_.sensor_channels.size() != kSensorCoils,
              "{}: {} sensor channels; three are needed: select them and the reference with --columns and --reference",
              capture_.path(), result_.sensor_channels.size());
    reference_.setOnes(static_cast<Index>(w_.size()));
    if (result_.reference_channel) {
        reference_.setZero();
        for (const Tones& block : tones) {
            reference_ +=
                block.amplitude.row(*result_.reference_channel).cwiseAbs().transpose() / static_cast<double>(tones.size());
        }
        result_.reference_amplitude = reference_(0);
    }
}

/// Calls `use` with coil, column and tone: couplings that are real, but for the quadrature.
void Analyser::for_each_column(const CapturedBlock& block, const Tones& tones, const auto& use) {
    for (int j = 0; j < kSourceCoils; ++j) {
        if (!block.drives(j)) {
            continue;
        }
        const Index k = w_.size() == 1 ? 0 : j;
        Vec3<Complex> z;
        for (std::size_t c = 0; c < kSensorCoils; ++c) {
            z(static_cast<Index>(c)) = tones.amplitude(result_.sensor_channels[c], k) / phases_(static_cast<Index>(c), k);
        }
        if (result_.reference_channel) {
            const Complex reference = tones.amplitude(*result_.reference_channel, k);
            const double share = std::abs(reference) / reference_(k);
            refuse_if(!(share >= kMinReferenceShare),
                      "{}: the reference drops out in repeat {}, to {:.1f} % of its mean amplitude", capture_.path(),
                      block.repeat, 100 * share);
            z /= reference;
        } else {  // the sign of the column before
            z *= std::polar(1.0, -std::arg(z(0) * z(0) + z(1) * z(1) + z(2) * z(2)) / 2);
            z *= z.real().dot(columns_.col(j).real()) < 0 ? -1 : 1;
        }
        columns_.col(j) = z;
        use(j, z, k);
    }
}

/// The phase of each sensor channel relative to the reference, and the sign of all couplings. The phase of squared couplings does
/// not depend on their signs; each channel's phase is within a quarter turn of the common one.
void Analyser::find_phases(const std::vector<CapturedBlock>& blocks, const std::vector<Tones>& tones) {
    Mat3<Complex> squares = Mat3<Complex>::Zero();
    const auto for_all = [&](const auto& use) {
        for (std::size_t n = 0; n < blocks.size(); ++n) {
            for_each_column(blocks[n], tones[n], use);
        }
    };
    for_all([&](int, const Vec3<Complex>& z, Index k) { squares.col(k) += z.cwiseProduct(z); });
    for (Index k = 0; k < static_cast<Index>(w_.size()) && result_.reference_channel; ++k) {
        const Complex common = std::polar(1.0, std::arg(squares(0, k) + squares(1, k) + squares(2, k)) / 2);
        const double sign = k > 0 && std::real(common / phases_(0, 0)) < 0 ? -1 : 1;  // phases differ little between carriers
        for (Index c = 0; c < kSensorCoils; ++c) {
            phases_(c, k) = sign * common * std::polar(1.0, std::arg(squares(c, k) / (common * common)) / 2);
        }
    }
    for (Index c = 0; c < kSensorCoils; ++c) {
        result_.phase_deg.push_back(kDegrees * std::arg(phases_(c, 0)));
    }
    Mat3<Complex> sum = Mat3<Complex>::Zero();
    columns_.setZero();
    for_all([&](int j, const Vec3<Complex>& z, Index) { sum.col(j) += z; });
    columns_.setZero();
    sign_ = Mat3<double>(sum.real()).determinant() < 0 ? -1 : 1;
}

void Analyser::add(const CapturedBlock& block, const Tones& tones) {
    Repeat& repeat = repeats_[block.repeat];
    const auto begin = static_cast<double>(block.begin + params_.guard_samples);
    repeat.begin = repeat.coils == 0 ? begin : repeat.begin;
    repeat.end = begin + static_cast<double>(samples_);
    for_each_column(block, tones, [&](int j, const Vec3<Complex>& z, Index k) {
        refuse_if((repeat.coils & (1 << j)) != 0, "{}: repeat {} holds state S{} twice", capture_.path(), block.repeat, j + 1);
        repeat.coils |= 1 << j;
        repeat.columns.col(j) = sign_ * z;
        for (const int c : result_.sensor_channels) {
            const double noise = tones.noise(c) / reference_(k);
            repeat.variance += 2 * noise * noise / static_cast<double>(samples_ * kCouplings);
        }
    });
    if (repeat.coils == (1 << kSourceCoils) - 1) {
        end_repeat(repeat);
        repeats_.erase(block.repeat);
    }
}

void Analyser::end_repeat(const Repeat& repeat) {
    const CaptureRow row{(repeat.begin + repeat.end) / 2 / result_.rate_hz, repeat.columns.real(), repeat.columns.imag(),
                         std::sqrt(repeat.variance)};
    ++result_.repeats;
    result_.mean += row.x;
    result_.quadrature += row.quadrature;
    result_.mean_sigma += repeat.variance;
    squares_ += result_.repeats > 1 ? Mat3<double>((row.x - last_x_).cwiseAbs2()) : Mat3<double>::Zero();
    last_x_ = row.x;
    put_(row);
}

/// A sensor is present if its couplings are large relative to their scatter and fit a dipole.
void detect_sensor(CaptureAnalysis& analysis) {
    const tracking::CommonParams<double> limits;
    const double scatter = std::sqrt(analysis.scatter.squaredNorm() / 9);
    analysis.singular_values = singular_values(eigen(analysis.mean));
    analysis.determinant = analysis.mean.determinant();
    const auto solution = solver::solve_direct<double>(analysis.mean, 1.0);
    if (!solution.ok()) {
        analysis.verdict = std::string("no sensor: ") + solution.status().message();
        return;
    }
    analysis.strength = solution->strength;
    analysis.snr_db = 20 * std::log10(analysis.strength / std::max(scatter, 1e-300));
    analysis.misfit_share = solution->misfit_squared / analysis.mean.squaredNorm();
    if (analysis.strength < limits.min_snr * scatter) {
        analysis.verdict = fmt::format("no sensor: couplings are only {:.1f} dB above their scatter, {:.0f} dB are needed",
                                       analysis.snr_db, 20 * std::log10(limits.min_snr));
    } else if (analysis.misfit_share > limits.max_misfit) {
        analysis.verdict = fmt::format(
            "no sensor: {:.0f} % of the couplings' power fits no dipole ({:.0f} % is the limit); singular values {:.2f} : {:.2f} "
            ": 1 instead of about 2 : 1 : 1. Inputs that are not connected can cause this",
            100 * analysis.misfit_share, 100 * limits.max_misfit, analysis.singular_values(0) / analysis.singular_values(2),
            analysis.singular_values(1) / analysis.singular_values(2));
    } else {
        analysis.sensor_present = true;
        analysis.verdict = "sensor present";
    }
}

CaptureAnalysis Analyser::run() {
    const std::vector<CapturedBlock> setup = read_setup();
    estimate_frequencies(setup);
    std::vector<Tones> tones;
    std::ranges::transform(setup, std::back_inserter(tones), [&](const CapturedBlock& block) { return tones_of(block); });
    check_signal(tones);
    choose_channels(tones);
    find_phases(setup, tones);
    for (std::size_t n = 0; n < setup.size(); ++n) {
        add(setup[n], tones[n]);
    }
    for (CapturedBlock block = setup.back(); read(block);) {
        add(block, tones_of(block));
    }
    refuse_if(!repeats_.empty() && !capture_.follows(), "{}: repeat {} lacks a state; each needs S1, S2 and S3", capture_.path(),
              repeats_.begin()->first);
    refuse_if(result_.repeats < 2, "{}: {} complete repeats; the scatter needs two or more", capture_.path(), result_.repeats);
    const double n = result_.repeats;
    result_.mean /= n;
    result_.quadrature /= n;
    result_.scatter = (squares_ / (2 * (n - 1))).cwiseSqrt();
    result_.mean_sigma = std::sqrt(result_.mean_sigma / n);
    detect_sensor(result_);
    return result_;
}

}  // namespace

CaptureAnalysis analyse_capture(CaptureReader& capture, const CaptureParams& params,
                                const std::function<void(const CaptureRow&)>& put) {
    return Analyser(capture, params, put).run();
}

}  // namespace tricoil::host

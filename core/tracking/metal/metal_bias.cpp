#include "core/tracking/metal/metal_bias.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/rotations.hpp"
#include "core/tracking/judge/misfit.hpp"

namespace tricoil::tracking {
namespace {

constexpr double kSystematic = 1e-4;  // error of the low band by motion within a frame, relative to the couplings

/// Fraction of a difference that is used: none if it is within its noise, all if it is much larger (positive-part James-Stein
/// estimate). So the noise of the low band does not reach poses without metal. variance: per axis.
double significant_fraction(const Vec3<double>& difference, double variance) {
    constexpr double kNoise = 6;  // twice the expected square of noise
    const double squared = difference.squaredNorm();
    return squared > kNoise * variance ? 1 - kNoise * variance / squared : 0;
}

/// Estimated square of a true difference, without that of its noise.
double significant_square(const Vec3<double>& difference, double variance) {
    return std::max(difference.squaredNorm() - 3 * variance, 0.0);
}

/// A bias at the present, and the variance per axis of its change since the window.
struct Present {
    Vec3<double> bias;
    double change_variance;
};

/// before: mean of a window half a window earlier. Both windows share half of their frames, so their difference has the variance
/// of one, and their average three quarters of it. The middle of the newer window is half a window and one frame old, that of
/// both three quarters of a window: too old if something moves.
Present extrapolate(const Vec3<double>& mean, const Vec3<double>& before, double variance, bool rests) {
    constexpr double kRelativeError = 0.5;
    const Vec3<double> change = significant_fraction(mean - before, variance) * (mean - before);
    const Vec3<double> middle = rests ? Vec3<double>(0.5 * (mean + before)) : mean;
    return {middle + (rests ? 1.5 : 1) * change, kRelativeError * kRelativeError * change.squaredNorm()};
}

}  // namespace

MetalBias::MetalBias(const CommonParams<double>& common, const DualBandParams& bands)
    : common_(common),
      bands_(bands),
      model_(field::GeneralDipole<double>::concentric(common.coupling_constant)),
      window_(bands.window_frames),
      share_(bands.window_frames),
      ratios_(bands.window_frames) {}

void MetalBias::clear() {
    window_.clear();
    share_ = BandShare(bands_.window_frames);
    ratios_ = SignalRatios(bands_.window_frames);
    spectrum_.reset();
    has_frame_ = false;
}

void MetalBias::add_high(const ComplexCouplings& couplings, const solver::RigidPose<double>& pose) {
    pose_ = pose;
    last_misfit_ = misfit_;
    high_ = vec(couplings.in_phase);
    high_quadrature_ = couplings.quadrature;
    misfit_ = high_ - vec(field::signal_matrix(model_, pose.position_m,
                                               Mat3<double>(pose.q_source_sensor.conjugate().toRotationMatrix())));
    if (has_frame_ && misfit_jumps()) {
        clear();
    } else if (has_frame_) {
        changes_ = std::min(changes_ + 1, bands_.window_frames);
        const double seen = (misfit_ - last_misfit_).squaredNorm() / 6;
        high_variance_ += (seen - high_variance_) / changes_;
    }
    has_frame_ = true;
}

/// True if metal has come or gone within one frame.
bool MetalBias::misfit_jumps() const {
    constexpr double kSignificant = 60;
    constexpr double kJump = 0.04;  // of the squared misfit; metal that passes at 1 m/s changes it less within a frame
    const double change = (misfit_ - last_misfit_).squaredNorm();
    return changes_ == bands_.window_frames && change > kSignificant * high_variance_ &&
           change > kJump * std::max(misfit_.squaredNorm(), last_misfit_.squaredNorm());
}

void MetalBias::add_low(const ComplexCouplings& couplings, double sigma) {
    BandFrame frame;
    if (const auto bias = estimate()) {  // the model is linear only near the pose of the low band
        frame.offset.head<3>() = difference_ratio() * bias->position_m.value;
        frame.offset.tail<3>() = difference_ratio() * bias->rotation_rad.value;
    }
    const Quat<double> q = geometry::rotation_vector_to_quaternion(Vec3<double>(-frame.offset.tail<3>())) * pose_.q_source_sensor;
    const auto model = field::signal_model(model_, Vec3<double>(pose_.position_m - frame.offset.head<3>()),
                                           Mat3<double>(q.normalized().conjugate().toRotationMatrix()));
    frame.excess = vec(model.x - couplings.in_phase);
    frame.jacobian = model.jacobian;
    frame.high_misfit = misfit_;
    frame.low_quadrature = vec(couplings.quadrature);
    frame.high_quadrature = vec(high_quadrature_);
    frame.high = high_;
    frame.low_variance = sigma * sigma;
    systematic_ = kSystematic * couplings.in_phase.norm() / 3;
    window_.add(frame);
    if (window_.has_mean()) {
        const BandComparison now = comparison(0);
        share_.add(now.low_misfit(), now.high_misfit, now.low_variance, common_.calibration_variance(strength()));
        if (common_.quadrature_floor < 1) {
            ratios_.add(now.misfit, now.high_misfit, noise(now));
            spectrum_ = MetalSpectrum::fit(ratios_.value(), ratios_.variance());
        }
    }
}

/// True if neither sensor nor metal moves much.
bool MetalBias::rests() const {
    constexpr double kRest = 2e-3;  // change of the couplings within a window, relative: 0.3 mm at 0.5 m
    return window_.change().norm() < kRest * high_.norm();
}

double MetalBias::strength() const { return field::coupling_strength(common_.coupling_constant, pose_.position_m.norm()); }

BandComparison MetalBias::comparison(int age) const { return BandComparison(window_.mean(age), pose_.position_m.norm()); }

/// Difference of the bands relative to the bias of the high band.
double MetalBias::difference_ratio() const { return spectrum_ ? ratios_.value()(2) : 1 / share_.gain(); }

/// Variance of the signals of one coupling in the mean of the newest window. Motion causes a quadrature: a mean rate X' at most
/// X' T / 2 in the low band, where T is the length of a frame.
MetalSignals MetalBias::noise(const BandComparison& window) const {
    constexpr double kLowLag = 0.5;  // of a frame
    const double window_s = window_.frames() * bands_.frame_s;
    const double rate_squared = window_.change().squaredNorm() / 9 / (window_s * window_s);
    const double floor = common_.quadrature_floor * strength();
    const auto by_motion = [&](double lag_s) { return lag_s * lag_s * rate_squared + floor * floor; };
    return {window.low_variance + by_motion(kLowLag * bands_.frame_s),
            high_variance_ / window_.frames() + by_motion(common_.quadrature_lag_s),
            window.low_variance + systematic_ * systematic_};
}

MetalBias::Extrapolation MetalBias::by_share() const {
    return {Vec3<double>(0, 0, share_.gain()), 0, share_.gain_sigma() / std::abs(share_.gain())};
}

/// The spectrum must be known.
MetalBias::Extrapolation MetalBias::by_spectrum(const BandComparison& window) const {
    const double misfit_squared = window.high_misfit.squaredNorm();
    const auto [weights, variance] = spectrum_->extrapolate(misfit_squared / 3, noise(window));
    // What the spectrum leaves of the misfit is a sample of its error. The factor was chosen over random objects.
    constexpr double kHiddenSquare = 4;
    const double left = (window.high_misfit - window.misfit * weights).squaredNorm() / 3;
    // The misfit of the coils is in no signal. Noise changes the ratios and so the weights.
    const double by_floor_squared = 3 * common_.calibration_variance(strength()) / std::max(misfit_squared, 1e-30);
    const double by_ratios_squared = weights.cwiseAbs2().dot(ratios_.variance());
    return {weights, variance + kHiddenSquare * left, std::sqrt(by_floor_squared + by_ratios_squared)};
}

/// The way with the smaller error.
MetalBias::Extrapolation MetalBias::extrapolation(const BandComparison& window) const {
    const auto variance = [&](const Extrapolation& e) {
        const double effect_variance = window.high_misfit.squaredNorm() / 3;
        return e.weights.cwiseAbs2().dot(noise(window)) + e.variance + e.relative_error * e.relative_error * effect_variance;
    };
    const Extrapolation share = by_share();
    if (!spectrum_) {
        return share;
    }
    const Extrapolation spectrum = by_spectrum(window);
    return variance(spectrum) < variance(share) ? spectrum : share;
}

/// Variance of a coupling by metal that has come or gone since the window: the misfit shows three of nine directions.
double MetalBias::new_misfit_variance(const BandComparison& window) const {
    constexpr double kSignificant = 20;  // chi-square of three degrees of freedom
    const double squared = (misfit_ - window.high_misfit).squaredNorm();
    return squared > kSignificant * high_variance_ ? kHiddenShare * kHiddenShare * squared / 3 : 0;
}

std::optional<MetalBiasEstimate> MetalBias::estimate() const {
    if (!window_.has_mean()) {
        return std::nullopt;
    }
    const int half = window_.frames() / 2;
    const BandComparison now = comparison(0);
    const BandComparison before = window_.has_mean(half) ? comparison(half) : now;
    if (!(now.covariance(0, 0) > 0)) {
        return std::nullopt;
    }
    const Extrapolation to_bias = extrapolation(now);
    const double noise_variance = to_bias.weights.cwiseAbs2().dot(noise(now));
    MetalBiasEstimate out;
    out.covariance = (noise_variance + to_bias.variance + new_misfit_variance(now)) * now.covariance;
    const auto bias = [&](int first) {
        const Vec3<double> mean = now.pose.middleRows<3>(first) * to_bias.weights;
        const Vec3<double> earlier = before.pose.middleRows<3>(first) * to_bias.weights;
        auto covariance = out.covariance.block<3, 3>(first, first);
        const double variance = noise_variance * now.covariance.block<3, 3>(first, first).trace() / 3;
        const Present present = extrapolate(mean, earlier, variance, rests());
        const double by_extrapolation = to_bias.relative_error * to_bias.relative_error * present.bias.squaredNorm() / 3;
        covariance.diagonal() += Vec3<double>::Constant(present.change_variance + by_extrapolation);
        return Bias{significant_fraction(present.bias, variance) * present.bias,
                    std::sqrt(significant_square(present.bias, variance)), std::sqrt(covariance.trace() / 3)};
    };
    out.position_m = bias(0);
    out.rotation_rad = bias(3);
    return out;
}

}  // namespace tricoil::tracking

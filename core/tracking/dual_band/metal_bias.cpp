#include "core/tracking/dual_band/metal_bias.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/rotations.hpp"
#include "core/tracking/misfit.hpp"

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

/// Difference of the bands at the present, and the variance per axis of its change since the window.
struct Present {
    Vec3<double> difference;
    double change_variance;
};

/// before: mean of a window half a window earlier. Both windows share half of their frames, so their difference has the variance
/// of one. The middle of the newer window is half a window and one frame old.
Present extrapolate(const Vec3<double>& mean, const Vec3<double>& before, double variance) {
    constexpr double kRelativeError = 0.5;
    const Vec3<double> change = significant_fraction(mean - before, variance) * (mean - before);
    return {mean + change, kRelativeError * kRelativeError * change.squaredNorm()};
}

}  // namespace

MetalBias::MetalBias(const MetalBiasParams& params)
    : params_(params),
      model_(field::GeneralDipole<double>::concentric(params.coupling_constant)),
      window_(params.window_frames),
      share_(params.window_frames) {}

void MetalBias::clear() {
    window_.clear();
    share_ = BandShare(params_.window_frames);
    has_frame_ = false;
}

void MetalBias::add_high(const Mat3<double>& couplings, const solver::RigidPose<double>& pose) {
    pose_ = pose;
    last_misfit_ = misfit_;
    misfit_ = vec(couplings - field::signal_matrix(model_, pose.position_m,
                                                   Mat3<double>(pose.q_source_sensor.conjugate().toRotationMatrix())));
    if (has_frame_ && misfit_jumps()) {
        clear();
    } else if (has_frame_) {
        constexpr int kMemory = 50;
        changes_ = std::min(changes_ + 1, kMemory);
        const double seen = (misfit_ - last_misfit_).squaredNorm() / 6;
        high_variance_ += (seen - high_variance_) / changes_;
    }
    has_frame_ = true;
}

/// True if metal has come or gone within one frame.
bool MetalBias::misfit_jumps() const {
    constexpr int kFewest = 8;  // changes; fewer do not give the noise
    constexpr double kSignificant = 60;
    constexpr double kJump = 0.04;  // of the squared misfit; metal that passes at 1 m/s changes it less within a frame
    const double change = (misfit_ - last_misfit_).squaredNorm();
    return changes_ >= kFewest && change > kSignificant * high_variance_ &&
           change > kJump * std::max(misfit_.squaredNorm(), last_misfit_.squaredNorm());
}

void MetalBias::add_low(const Mat3<double>& couplings, double sigma) {
    BandFrame frame;
    if (const auto bias = estimate()) {  // the model is linear only near the pose of the low band
        frame.offset.head<3>() = bias->position_m.value / share_.gain();
        frame.offset.tail<3>() = bias->rotation_rad.value / share_.gain();
    }
    const Quat<double> q = geometry::rotation_vector_to_quaternion(Vec3<double>(-frame.offset.tail<3>())) * pose_.q_source_sensor;
    const auto model = field::signal_model(model_, Vec3<double>(pose_.position_m - frame.offset.head<3>()),
                                           Mat3<double>(q.normalized().conjugate().toRotationMatrix()));
    frame.excess = vec(model.x - couplings);
    frame.jacobian = model.jacobian;
    frame.high_misfit = misfit_;
    frame.low_variance = sigma * sigma;
    systematic_ = kSystematic * couplings.norm() / 3;
    window_.add(frame);
    if (window_.has_mean()) {
        const BandDifference now = difference(0);
        share_.add(now.low_misfit, now.high_misfit, now.low_variance,
                   params_.misfit_floor * field::coupling_strength(params_.coupling_constant, pose_.position_m.norm()));
    }
}

BandDifference MetalBias::difference(int age) const { return BandDifference(window_.mean(age), pose_.position_m.norm()); }

/// Variance of a coupling by metal that has come or gone since the window: the misfit shows three of nine directions.
double MetalBias::new_misfit_variance(const BandDifference& window) const {
    constexpr double kSignificant = 20;  // chi-square of three degrees of freedom
    const double squared = (misfit_ - window.high_misfit).squaredNorm();
    return squared > kSignificant * high_variance_ ? kHiddenShare * kHiddenShare * squared / 3 : 0;
}

std::optional<MetalBiasEstimate> MetalBias::estimate() const {
    if (!window_.has_mean()) {
        return std::nullopt;
    }
    const int half = window_.frames() / 2;
    const BandDifference now = difference(0);
    const BandDifference before = window_.has_mean(half) ? difference(half) : now;
    if (!(now.covariance(0, 0) > 0)) {
        return std::nullopt;
    }
    const double noise = now.low_variance + systematic_ * systematic_;
    const double coupling_variance = share_.gain() * share_.gain() * noise + new_misfit_variance(now);
    MetalBiasEstimate out;
    out.covariance = coupling_variance * now.covariance;
    const auto bias = [&](int first) {
        const Vec3<double> earlier = before.pose.segment<3>(first);
        auto covariance = out.covariance.block<3, 3>(first, first);
        const double unit_variance = now.covariance.block<3, 3>(first, first).trace() / 3;
        const Present present = extrapolate(now.pose.segment<3>(first), earlier, noise * unit_variance);
        const Vec3<double>& d = present.difference;
        const double by_change = share_.gain() * share_.gain() * present.change_variance;
        const double by_share = share_.gain_sigma() * share_.gain_sigma() * d.squaredNorm() / 3;
        covariance.diagonal().array() += by_change + by_share;
        return Bias{share_.gain() * significant_fraction(d, noise * unit_variance) * d,
                    std::abs(share_.gain()) * std::sqrt(significant_square(d, noise * unit_variance)),
                    std::sqrt(covariance.trace() / 3)};
    };
    out.position_m = bias(0);
    out.rotation_rad = bias(3);
    return out;
}

}  // namespace tricoil::tracking

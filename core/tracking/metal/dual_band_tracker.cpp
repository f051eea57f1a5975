#include "core/tracking/metal/dual_band_tracker.hpp"

#include <algorithm>
#include <cmath>

#include "core/geometry/rotations.hpp"
#include "core/solver/pose_covariance.hpp"
#include "core/tracking/judge/misfit.hpp"

namespace tricoil::tracking {

namespace {

/// Parameters with the quadrature floor of both bands.
CommonParams<double> of_both_bands(CommonParams<double> common, const Tracker<double>::Correction& correction) {
    if (correction) {
        common.quadrature_floor = std::max(common.quadrature_floor, correction->low_band().quadrature_floor);
    }
    return common;
}

Mat3<double> quadrature_of(const SignalMatrixAssembler<double>& columns) {
    Mat3<double> quadrature;
    quadrature << columns.latest(0).quadrature, columns.latest(1).quadrature, columns.latest(2).quadrature;
    return quadrature;
}

/// Sum over the three axes.
double position_variance(const Mat6<double>& covariance) { return covariance.topLeftCorner<3, 3>().trace(); }

}  // namespace

DualBandTracker::DualBandTracker(const TrackerParams<double>& params, const Correction& correction)
    : MatrixTracker<double>(params.common, false, {}, correction),
      frame_s_(std::get_if<DualBandParams>(&params.method)->frame_s),
      bias_(of_both_bands(this->params(), correction), *std::get_if<DualBandParams>(&params.method)),
      mean_quadrature_(*std::get_if<DualBandParams>(&params.method), this->params().quadrature_lag_s,
                       correction ? correction->low_band().motion_lag_s : Mat3<double>::Zero()) {}

void DualBandTracker::do_set_hemisphere(const Vec3<double>& towards) {
    MatrixTracker<double>::do_set_hemisphere(towards);
    bias_.clear();
}

/// Low-band columns that come before those of the high band of their frame are not used.
void DualBandTracker::do_update_low(const Column<double>& column) {
    if (!awaits_low_ || column.midpoint != last_frame_ || invalid_field(column) || column.flags.has_any(kUnusable)) {
        return;
    }
    if (const auto matrix = low_.add(column)) {
        awaits_low_ = false;
        bias_.add_low({matrix->x, quadrature_of(low_)}, matrix->sigma);
    }
}

void DualBandTracker::do_refine(const SignalMatrixAssembler<double>& columns, PoseEstimate<double>& estimate) {
    follow(quadrature_of(columns), estimate);
    if (!awaits_low_) {
        return;
    }
    const auto bias = bias_.estimate();
    const bool is_corrected = bias && correct(*bias, estimate);
    if (!is_corrected) {
        cover_hidden_metal(bias, estimate);
    }
}

/// Passes the frame to the bias, which starts again after a lost frame of either band, a jump of the clock, a fault, or a change
/// of the hemisphere.
void DualBandTracker::follow(const Mat3<double>& quadrature, const PoseEstimate<double>& high) {
    constexpr double kTolerance = 0.5;  // of a frame
    const double step_s = seconds_as<double>(high.time - last_frame_);
    const bool is_next = std::abs(step_s - frame_s_) < kTolerance * frame_s_;
    const bool is_low_missing = awaits_low_;
    const bool is_mirrored = high.position_m.dot(last_position_m_) < 0;
    awaits_low_ = !high.flags.has_any(kFaultFlags);
    if (!awaits_low_ || is_low_missing || !is_next || is_mirrored) {
        bias_.clear();
    }
    if (!awaits_low_ || !is_next) {
        mean_quadrature_.clear();
    }
    low_.clear();
    last_frame_ = high.time;
    last_position_m_ = high.position_m;
    if (awaits_low_) {
        bias_.add_high({high.signal_matrix, quadrature}, {high.position_m, high.q_source_sensor});
        mean_quadrature_.add(high.signal_matrix, quadrature, std::pow(coupling_noise(high, params().coupling_constant), 2));
    }
}

/// False if the bands do not determine the bias better than the covariance of the high band: the pose then stays as it is.
bool DualBandTracker::correct(const MetalBiasEstimate& bias, PoseEstimate<double>& estimate) const {
    const auto& [position, rotation, covariance] = bias;
    const Mat6<double> noise = noise_covariance(estimate);
    const double bias_m = position.value.norm();
    const bool is_better =
        std::sqrt(position_variance(noise + covariance)) < std::hypot(deviation_m(estimate), position.magnitude);
    if (is_better) {
        estimate.position_m -= position.value;
        estimate.q_source_sensor =
            (geometry::rotation_vector_to_quaternion(Vec3<double>(-rotation.value)) * estimate.q_source_sensor).normalized();
        // The share changes while the metal or the sensor moves, and differs between the couplings. Both constants were chosen
        // over the random objects of tests/support/metal_case.hpp. Near ferromagnetic metal it may differ by any factor.
        constexpr double kMargin = 2;
        constexpr double kShareError = 0.02;  // of the deviation that the misfit of the high band suggests
        const double share_error = bias_.share().is_ferromagnetic() ? 1 : kShareError;
        const Mat6<double> left = covariance + share_error * share_error * estimate.covariance;
        estimate.covariance = noise + left + (kMargin - 1) * covariance;
        estimate.distortion_m = kLikelyShare * std::sqrt(position_variance(left));
    } else {
        estimate.covariance.diagonal().head<3>() += Vec3<double>::Constant(position.magnitude * position.magnitude / 3);
        estimate.covariance.diagonal().tail<3>() += Vec3<double>::Constant(rotation.magnitude * rotation.magnitude / 3);
        estimate.distortion_m = std::max(estimate.distortion_m, bias_m);
    }
    constexpr double kDeviations = 5;
    estimate.flags.set_if(bias_m > kDeviations * position.sigma, PoseFlag::distorted);
    estimate.flags.clear(PoseFlag::uncertain);  // that was the high band alone
    estimate.flags.set_if(!(deviation_m(estimate) <= params().max_deviation_m), PoseFlag::uncertain);
    return is_better;
}

/// For metal that shows in the mean quadrature. The error that it may cause is at most what the low band would not show either.
void DualBandTracker::cover_hidden_metal(const std::optional<MetalBiasEstimate>& bias, PoseEstimate<double>& estimate) const {
    if (params().quadrature_floor >= 1) {
        return;
    }
    const double effect = std::sqrt(mean_quadrature_.effect_variance(params().quadrature_floor * strength(estimate)));
    const Mat6<double> hidden = covariance_for(effect, estimate);
    const bool is_limited = bias && position_variance(bias->covariance) < position_variance(hidden);
    estimate.covariance += is_limited ? bias->covariance : hidden;
    estimate.flags.set_if(!(deviation_m(estimate) <= params().max_deviation_m), PoseFlag::uncertain);
}

double coupling_noise(const PoseEstimate<double>& estimate, double coupling_constant) {
    return field::coupling_strength(coupling_constant, estimate.position_m.norm()) / std::pow(10, estimate.snr_db / 20);
}

double DualBandTracker::strength(const PoseEstimate<double>& estimate) const {
    return field::coupling_strength(params().coupling_constant, estimate.position_m.norm());
}

/// Of the high band's pose, from noise and the misfit of calibrated coils, without metal.
Mat6<double> DualBandTracker::noise_covariance(const PoseEstimate<double>& estimate) const {
    const double noise = coupling_noise(estimate, params().coupling_constant);
    return covariance_for(std::sqrt(noise * noise + params().calibration_variance(strength(estimate), params().floor_share)),
                          estimate);
}

/// sigma: of a coupling.
Mat6<double> DualBandTracker::covariance_for(double sigma, const PoseEstimate<double>& estimate) const {
    const double range_m = estimate.position_m.norm();
    return solver::pose_covariance<double>(strength(estimate), range_m, estimate.position_m / range_m, sigma);
}

}  // namespace tricoil::tracking

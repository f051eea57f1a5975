#include "board/host/smooth/smoothing_tap.hpp"

#include "core/field/concentric_dipole.hpp"
#include "core/geometry/quaternion_sign.hpp"
#include "core/linear/cholesky.hpp"
#include "core/solver/pose_covariance.hpp"
#include "core/tracking/metal/dual_band_tracker.hpp"
#include "core/tracking/scaat/column_update.hpp"
#include "core/tracking/scaat/report.hpp"

namespace tricoil::host {
namespace {

using Pose = tracking::PoseEstimate<double>;

bool has_two_bands(const TrackerSettings& settings) {
    return std::holds_alternative<tracking::DualBandParams>(settings.tracker.method);
}

/// Settings of the filter on the couplings that ideal coils would have.
TrackerSettings for_ideal_coils(TrackerSettings settings) {
    settings.calibration.reset();
    settings.tracker.common.misfit_floor = 0;
    return for_smoothing(settings);
}

using tracking::scaat::FilterState;
using tracking::scaat::Mat12;
using tracking::scaat::Motion;
using tracking::scaat::State;
using tracking::scaat::Vec12;

constexpr std::size_t kPiece = 32'768;     // poses
constexpr std::size_t kFollowing = 4'096;  // poses after a piece that still have an effect on it

/// Factor on the smoothed covariance. Over the recorded motions squared errors are 0.69 (TDM) to 0.79 (FDM) of it, because real
/// accelerations are correlated and those of the model are white.
constexpr double kCovarianceShare = 0.75;

Vec12<double> difference(const Motion<double>& a, const Motion<double>& b) {
    Vec12<double> d;
    d << a.position_m - b.position_m,
        geometry::quaternion_to_rotation_vector<double>(a.q_source_sensor * b.q_source_sensor.conjugate()),
        a.velocity_m_s - b.velocity_m_s, a.rate_rad_s - b.rate_rad_s;
    return d;
}

/// One step back: the smoothed state at the time of `filter`, from the smoothed state `next`.
State<double> step_back(const FilterState<double>& filter, const State<double>& next) {
    State<double> predicted = filter.state;
    tracking::scaat::propagate(predicted, filter.intensity, next.time);
    Mat12<double> moved = filter.state.covariance;  // F P, with F = [I, dt I; 0, I]
    moved.topRows<6>() += to_seconds(next.time - filter.state.time) * filter.state.covariance.bottomRows<6>();
    State<double> smoothed = filter.state;
    const Cholesky<double, 12> factor(predicted.covariance);
    if (!factor.ok()) {  // later columns tell nothing about this state
        return smoothed;
    }
    const Mat12<double> gain = factor.solve(moved).transpose();
    tracking::scaat::correct<double>(smoothed, gain * difference(next, predicted));
    smoothed.covariance += gain * (next.covariance - predicted.covariance) * gain.transpose();
    return smoothed;
}

/// Converts a vector from the frame of corrected columns to the source frame.
Vec3<double> in_source_frame(const Vec3<double>& vector, const tracking::AnyTracker<double>& tracker) {
    tracking::PoseEstimate<double> end;
    tracking::PoseEstimate<double> begin;
    end.position_m = vector;
    tracker.to_source_frame(end);
    tracker.to_source_frame(begin);
    return end.position_m - begin.position_m;
}

}  // namespace

void Smoother::add(const tracking::PoseEstimate<double>& estimate, const tracking::AnyTracker<double>& tracker) {
    const bool begins = begins_interval(estimate, tracker);
    add({estimate, *tracker.filter_state(), begins}, tracker);
}

void Smoother::add_unsmoothed(const tracking::PoseEstimate<double>& estimate, const tracking::AnyTracker<double>& tracker) {
    add({estimate, {}, true}, tracker);
}

void Smoother::add(const Step& step, const tracking::AnyTracker<double>& tracker) {
    steps_.push_back(step);
    if (steps_.size() == kPiece + kFollowing) {
        smooth_first(kPiece, tracker);
    }
}

void Smoother::finish(const tracking::AnyTracker<double>& tracker) { smooth_first(steps_.size(), tracker); }

bool Smoother::begins_interval(const tracking::PoseEstimate<double>& estimate, const tracking::AnyTracker<double>& tracker) {
    const std::uint64_t inflations = tracker.counters().covariance_inflations;
    const bool is_inflated = std::exchange(inflations_, inflations) != inflations;
    const int run = tracker.filter_state()->run;
    return is_inflated || run == 0 || steps_.empty() || steps_.back().filter.run != run ||
           estimate.time < steps_.back().filtered.time;
}

SmoothedPose Smoother::reported(const Step& step, const tracking::scaat::State<double>& smoothed,
                                const tracking::AnyTracker<double>& tracker) {
    tracking::PoseEstimate<double> own = step.filtered;  // with the part of the covariance that smoothing reduces
    own.covariance =
        tracking::scaat::kCovarianceMargin * step.filter.covariance_factor * step.filter.state.covariance.topLeftCorner<6, 6>();
    tracker.to_source_frame(own);
    SmoothedPose result{step.filtered};
    tracking::PoseEstimate<double>& pose = result.pose;
    pose.position_m = smoothed.position_m;
    pose.q_source_sensor = smoothed.q_source_sensor;
    pose.covariance = kCovarianceShare * smoothed.covariance.topLeftCorner<6, 6>();
    tracker.to_source_frame(pose);
    pose.covariance += step.filtered.covariance - own.covariance;  // metal, blur
    pose.q_source_sensor = geometry::with_sign_of(pose.q_source_sensor, step.filtered.q_source_sensor);
    pose.flags.clear(tracking::PoseFlag::not_converged);
    pose.predicted_error.reset();
    result.velocity_m_s = in_source_frame(smoothed.velocity_m_s, tracker);
    result.rate_rad_s = in_source_frame(smoothed.rate_rad_s, tracker);
    return result;
}

/// Smooths all steps, delivers the first `count` and forgets them.
void Smoother::smooth_first(std::size_t count, const tracking::AnyTracker<double>& tracker) {
    std::vector<State<double>> smoothed(steps_.size());
    for (std::size_t k = steps_.size(); k-- > 0;) {
        const bool is_last = k + 1 == steps_.size() || steps_[k + 1].begins;
        smoothed[k] = is_last ? steps_[k].filter.state : step_back(steps_[k].filter, smoothed[k + 1]);
    }
    for (std::size_t k = 0; k < count; ++k) {
        const bool is_running = steps_[k].filter.run > 0;
        receiver_(is_running ? reported(steps_[k], smoothed[k], tracker) : SmoothedPose{steps_[k].filtered});
    }
    steps_.erase(steps_.begin(), steps_.begin() + static_cast<std::ptrdiff_t>(count));
}

TrackerSettings for_smoothing(TrackerSettings settings) {
    if (!std::holds_alternative<tracking::ScaatParams<double>>(settings.tracker.method)) {
        settings.tracker.method = tracking::ScaatParams<double>{};
    }
    std::get<tracking::ScaatParams<double>>(settings.tracker.method).predict_ahead = Microseconds{0};
    return settings;
}

SmoothingTap::Sensor::Sensor(const Settings& settings, const TrackerSettings& of_filter, const Smoother::Receiver& receiver)
    : filter(of_filter.tracker, of_filter.calibration),
      smoother(receiver),
      coupling_constant(settings.tracker.common.coupling_constant) {
    if (has_two_bands(settings)) {
        both_bands.emplace(settings.tracker, settings.calibration);
    }
}

/// The filter sees the couplings that ideal coils without metal would have at the pose of both bands: the pose has the noise of
/// the high band, which the smoother removes. What metal adds to the covariance stays, because it lasts from frame to frame.
std::optional<Pose> SmoothingTap::Sensor::filter_without_metal(const Pose& pose) {
    constexpr tracking::PoseFlags kNoSide{tracking::PoseFlag::hemisphere_unknown};
    if (pose.flags.has_any(tracking::kFaultFlags | kNoSide)) {
        return std::nullopt;
    }
    if (filter.filter_state()->run == 0 || filter.filter_state()->state.position_m.dot(pose.position_m) < 0) {
        (void)filter.set_hemisphere(pose.position_m);
    }
    const double sigma = tracking::coupling_noise(pose, coupling_constant);
    const Mat3<double> couplings = field::signal_matrix<double>(
        coupling_constant, pose.position_m, Mat3<double>(pose.q_source_sensor.conjugate().toRotationMatrix()));
    std::optional<Pose> filtered;
    for (int coil = 0; coil < kSourceCoils; ++coil) {
        Column<double> column;
        column.sensor = pose.sensor;
        column.state = single_coil(coil);
        column.midpoint = pose.time;
        column.sequence = column.state_sequence = columns++;
        column.in_phase = couplings.col(coil);
        column.sigma.setConstant(sigma);
        filtered = filter.update(column);
    }
    if (filtered) {
        const double range_m = pose.position_m.norm();
        const double strength = field::coupling_strength(coupling_constant, range_m);
        filtered->covariance +=
            pose.covariance - solver::pose_covariance<double>(strength, range_m, pose.position_m / range_m, sigma);
        filtered->sequence = pose.sequence;
        filtered->flags |= pose.flags;
        filtered->distortion_m = pose.distortion_m;
        filtered->distortion_chi_square = pose.distortion_chi_square;
        filtered->snr_db = pose.snr_db;
        filtered->signal_matrix = pose.signal_matrix;
    }
    return filtered;
}

void SmoothingTap::Sensor::take(const Column<double>& column) {
    if (!both_bands) {
        if (const auto estimate = filter.update(column)) {
            smoother.add(*estimate, filter);
        }
        return;
    }
    const auto pose = both_bands->update(column);
    if (!pose) {
        return;
    }
    if (const auto filtered = filter_without_metal(*pose)) {
        smoother.add(*filtered, filter);
    } else {
        smoother.add_unsmoothed(*pose, filter);
    }
}

void SmoothingTap::finish() {
    for (const auto& sensor : sensors_) {
        sensor->smoother.finish(sensor->filter);
    }
}

void SmoothingTap::do_begin(const Settings& settings) {
    finish();
    sensors_.clear();
    const TrackerSettings of_filter = has_two_bands(settings) ? for_ideal_coils(settings) : for_smoothing(settings);
    for (int n = 0; n < settings.sensors; ++n) {
        sensors_.push_back(std::make_unique<Sensor>(settings, of_filter, receiver_));
    }
}

void SmoothingTap::do_column(const MeasuredColumn<double>& column) { sensors_.at(column.sensor)->take(column); }

/// A pose from tick() contains no new column, so it is not smoothed.
void SmoothingTap::do_tick(std::uint8_t sensor, DeviceTime now) {
    Sensor& ticked = *sensors_.at(sensor);
    (void)ticked.filter.tick(now);
    if (ticked.both_bands) {
        (void)ticked.both_bands->tick(now);
    }
}

void SmoothingTap::do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) {
    Sensor& turned = *sensors_.at(sensor);
    tracking::AnyTracker<double>& tracker = turned.both_bands ? *turned.both_bands : turned.filter;
    (void)tracker.set_hemisphere(towards);  // a refused hemisphere is refused again
}

}  // namespace tricoil::host

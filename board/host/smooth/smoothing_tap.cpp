#include "board/host/smooth/smoothing_tap.hpp"

#include "core/field/concentric_dipole.hpp"
#include "core/solver/pose_covariance.hpp"
#include "core/tracking/metal/dual_band_tracker.hpp"

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

}  // namespace

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

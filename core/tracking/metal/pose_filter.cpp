#include "core/tracking/metal/pose_filter.hpp"

#include "core/field/concentric_dipole.hpp"
#include "core/solver/pose_covariance.hpp"
#include "core/tracking/metal/dual_band_tracker.hpp"

namespace tricoil::tracking {
namespace {

TrackerParams<double> filter_params(CommonParams<double> common, Microseconds predict_ahead) {
    common.misfit_floor = 0;  // of ideal coils
    common.pick_up_sigma = 0;
    ScaatParams<double> params;
    params.predict_ahead = predict_ahead;
    return {common, params};
}

}  // namespace

PoseFilter::PoseFilter(const CommonParams<double>& common, Microseconds predict_ahead)
    : filter_(filter_params(common, predict_ahead)), coupling_constant_(common.coupling_constant) {}

scaat::FilterState<double> PoseFilter::filter_state() const {
    scaat::FilterState<double> state = filter_.filter_state();
    state.run = is_filtered_ ? state.run : 0;
    return state;
}

PoseEstimate<double> PoseFilter::update(const PoseEstimate<double>& pose) {
    constexpr PoseFlags kNoSide{PoseFlag::hemisphere_unknown};
    newest_ = pose;
    const auto estimate = pose.flags.has_any(kFaultFlags | kNoSide) ? std::nullopt : filtered(pose);
    is_filtered_ = estimate.has_value();
    PoseEstimate<double> result = estimate ? with_metal(*estimate) : pose;
    result.sequence = poses_++;
    return result;
}

std::optional<PoseEstimate<double>> PoseFilter::tick(DeviceTime now, std::optional<PoseEstimate<double>> pose) {
    if (const auto estimate = is_filtered_ ? filter_.tick(now) : std::nullopt) {
        pose = with_metal(*estimate);
    }
    if (pose) {
        pose->sequence = poses_++;
    }
    return pose;
}

std::optional<PoseEstimate<double>> PoseFilter::filtered(const PoseEstimate<double>& pose) {
    if (filter_.filter_state().run == 0 || filter_.filter_state().state.position_m.dot(pose.position_m) < 0) {
        (void)filter_.set_hemisphere(pose.position_m);
    }
    const double sigma = coupling_noise(pose, coupling_constant_);
    const double range_m = pose.position_m.norm();
    const double strength = field::coupling_strength(coupling_constant_, range_m);
    of_metal_ = pose.covariance - solver::pose_covariance<double>(strength, range_m, pose.position_m / range_m, sigma);
    const Mat3<double> couplings = field::signal_matrix<double>(
        coupling_constant_, pose.position_m, Mat3<double>(pose.q_source_sensor.conjugate().toRotationMatrix()));
    std::optional<PoseEstimate<double>> estimate;
    for (int coil = 0; coil < kSourceCoils; ++coil) {
        Column<double> column;
        column.sensor = pose.sensor;
        column.state = single_coil(coil);
        column.midpoint = pose.time;
        column.sequence = column.state_sequence = columns_++;
        column.in_phase = couplings.col(coil);
        column.sigma.setConstant(sigma);
        estimate = filter_.update(column);
    }
    return estimate;
}

PoseEstimate<double> PoseFilter::with_metal(PoseEstimate<double> estimate) {
    estimate.covariance += of_metal_;
    estimate.flags |= newest_.flags;
    estimate.distortion_m = newest_.distortion_m;
    estimate.distortion_chi_square = newest_.distortion_chi_square;
    estimate.snr_db = newest_.snr_db;
    estimate.signal_matrix = newest_.signal_matrix;
    return estimate;
}

}  // namespace tricoil::tracking

#include "core/tracking/tracker.hpp"

#include <algorithm>
#include <cmath>

#include "core/field/concentric_dipole.hpp"
#include "core/solver/direct.hpp"
#include "core/solver/pose_covariance.hpp"
#include "core/tracking/signal_flags.hpp"

namespace tricoil::tracking {
namespace {

/// What makes a matrix worthless to extrapolate from, even by one column of it.
constexpr PoseFlags kBad{PoseFlag::saturated, PoseFlag::no_sensor, PoseFlag::wrong_handedness, PoseFlag::not_converged,
                         PoseFlag::no_reference};
constexpr int kMaxPasses = 10;

template <typename Scalar>
solver::AnglePose<Scalar> to_angles(const solver::VectorPose<Scalar>& pose) {
    return {geometry::to_spherical<Scalar>(pose.range_m * pose.direction), geometry::to_euler(pose.attitude)};
}

template <typename Scalar>
solver::VectorPose<Scalar> to_vectors(const solver::AnglePose<Scalar>& pose) {
    return {pose.position.range_m, geometry::direction(pose.position.azimuth_rad, pose.position.elevation_rad),
            geometry::attitude_matrix(pose.attitude)};
}

error_model::SolverForm form_of(Method method) {
    switch (method) {
        case Method::direct:
            break;
        case Method::previous:
            return error_model::SolverForm::previous_vectors;
        case Method::previous_angles:
            return error_model::SolverForm::previous_angles;
    }
    return error_model::SolverForm::direct;
}

template <typename Scalar>
bool is_positive(Scalar value) {
    return std::isfinite(value) && value > 0;
}

}  // namespace

Microseconds column_span(const signal::AcquisitionPlan& plan) {
    return plan.is_tdm() ? microseconds_from_seconds(2.5 * plan.block_s()) : Microseconds{0};
}

template <typename Scalar>
Status check(const TrackerParams<Scalar>& params) {
    if (!is_positive(params.coupling_constant)) {
        return {StatusCode::invalid_argument, "coupling constant must be positive and finite"};
    }
    if (!is_positive(params.min_snr) || !is_positive(params.max_misfit) || !is_positive(params.distortion_gate)) {
        return {StatusCode::invalid_argument, "signal limits must be positive and finite"};
    }
    if (params.passes < 1 || params.passes > kMaxPasses) {
        return {StatusCode::invalid_argument, "passes must be 1 to 10"};
    }
    if (params.max_column_span.count() < 0 || params.lost_after.count() <= 0 || params.search_after < params.lost_after) {
        return {StatusCode::invalid_argument, "times must be positive, and search_after not shorter than lost_after"};
    }
    if (!std::isfinite(params.window_s) || params.window_s < 0 || !std::isfinite(params.latency_s) || params.latency_s < 0) {
        return {StatusCode::invalid_argument, "window and latency must be finite and not negative"};
    }
    if (!params.hemisphere.allFinite()) {
        return {StatusCode::invalid_argument, "hemisphere must be a finite direction, or zero for unknown"};
    }
    return {};
}

template <typename Scalar>
Tracker<Scalar>::Tracker(const TrackerParams<Scalar>& params)
    : params_(params),
      assembler_(params.max_column_span, params.deskew),
      motion_(params.max_column_span.count() > 0 ? kSourceCoils : 1),
      time_base_(Microseconds{0}, params.lost_after),
      hemisphere_(params.hemisphere, params.confined) {}

template <typename Scalar>
Status Tracker<Scalar>::set_hemisphere(const Vec3<Scalar>& towards) {
    if (!towards.allFinite()) {
        return {StatusCode::not_finite, "hemisphere must be a finite direction, or zero for unknown"};
    }
    hemisphere_.set(towards);
    if (has_last_ && last_.pose.direction.dot(towards) < 0) {
        last_.pose.direction = -last_.pose.direction;
        last_.angles = to_angles(last_.pose);
        motion_.clear();  // the next pose is on the other side: their difference is no motion
    }
    return {};
}

template <typename Scalar>
std::optional<PoseEstimate<Scalar>> Tracker<Scalar>::update(const Column<Scalar>& column) {
    if (const auto reason = why_refused(column)) {
        ++counters_.rejected[static_cast<std::size_t>(*reason)];
        return std::nullopt;
    }
    ++counters_.accepted;
    const auto matrix = assembler_.add(column);
    if (!matrix) {
        return std::nullopt;
    }
    PoseEstimate<Scalar> estimate;
    estimate.sensor = column.sensor;
    estimate.sequence = static_cast<std::uint32_t>(counters_.poses++);
    estimate.time = matrix->newest;
    estimate.signal_matrix = matrix->x;
    estimate.flags = signal_flags(matrix->flags);
    Result<Followed> solved = follow(matrix->x);
    const bool followed = solved.ok();
    if (!followed) {
        solved = acquire(*matrix);
    }
    if (solved.ok()) {
        judge(*matrix, solved->pose, estimate);
        estimate.flags.set_if(!hemisphere_.known(), PoseFlag::hemisphere_unknown);
    } else {
        estimate.flags.set(solved.status().code() == StatusCode::degenerate ? PoseFlag::no_sensor : PoseFlag::not_converged);
    }
    doubt_history(estimate);
    if (estimate.valid()) {
        last_ = *solved;
        has_last_ = true;
        hemisphere_.follow(estimate.position_m, estimate.time);
    }
    advance(estimate.valid(), estimate.time);
    estimate.state = state_;
    counters_.invalid_poses += estimate.valid() ? 0U : 1U;
    if (estimate.valid()) {
        predict_error(*matrix, followed ? form_of(params_.method) : error_model::SolverForm::direct, estimate);
        last_estimate_ = estimate;
    }
    return estimate;
}

template <typename Scalar>
std::optional<PoseEstimate<Scalar>> Tracker<Scalar>::tick(DeviceTime now) {
    if (counters_.acquisitions == 0 || now > TimeBase::kLatest || now < TimeBase::kEarliest ||
        now - last_valid_ <= params_.lost_after) {
        return std::nullopt;
    }
    advance(false, now);
    PoseEstimate<Scalar> estimate = last_estimate_;
    estimate.sequence = static_cast<std::uint32_t>(counters_.poses++);
    estimate.flags.set(PoseFlag::stale);
    estimate.state = state_;
    ++counters_.invalid_poses;
    return estimate;
}

template <typename Scalar>
std::optional<Rejection> Tracker<Scalar>::why_refused(const Column<Scalar>& column) {
    if (const auto reason = why_unusable(column)) {
        return reason;
    }
    const auto verdict = time_base_.take(coil_index(column.state), column.midpoint, false);
    if (verdict == TimeBase::Verdict::restarted) {  // nothing that was known has a time any more
        ++counters_.clock_restarts;
        state_ = TrackerState::searching;
        has_last_ = false;
        last_valid_ = column.midpoint;
        assembler_.clear();
        motion_.clear();
        hemisphere_.forget();
    }
    return reason_of(verdict);
}

/// A column of a bad matrix looks good beside two others where nothing is left over to tell. It stays one of those that deskewing
/// extrapolates from for two columns of each state.
template <typename Scalar>
void Tracker<Scalar>::doubt_history(PoseEstimate<Scalar>& estimate) {
    constexpr int kHistory = 2 * kSourceCoils;
    if (!params_.deskew) {
        return;
    }
    const bool bad = estimate.flags.has_any(kBad);
    estimate.flags.set_if(doubtful_ > 0, PoseFlag::unconfirmed);
    doubtful_ = bad ? kHistory : std::max(doubtful_ - 1, 0);
}

/// The previous-measurement step from the last pose. Not ready when there is none to follow or the method does not follow;
/// not converged when the step leaves its domain or lands on a pose that explains the couplings worse than any sensor would.
template <typename Scalar>
auto Tracker<Scalar>::follow(const Mat3<Scalar>& x) const -> Result<Followed> {
    if (params_.method == Method::direct || state_ != TrackerState::tracking || !has_last_) {
        return Status{StatusCode::not_ready, "no pose to follow"};
    }
    Followed next;
    if (params_.method == Method::previous) {
        const auto stepped = solver::step_vectors(x, params_.coupling_constant, last_.pose, params_.passes);
        if (!stepped.ok()) {
            return stepped.status();
        }
        next.pose = *stepped;
    } else {
        const auto stepped = solver::step_angles(x, params_.coupling_constant, last_.angles, params_.passes);
        if (!stepped.ok()) {
            return stepped.status();
        }
        next = {to_vectors(*stepped), *stepped};
    }
    if (misfit_squared(x, next.pose) > params_.max_misfit * x.squaredNorm()) {
        return Status{StatusCode::not_converged, "the step from the last pose does not explain the couplings"};
    }
    return next;
}

/// The direct solution, in the hemisphere that continuity or the setting tells.
template <typename Scalar>
auto Tracker<Scalar>::acquire(const SignalMatrix<Scalar>& matrix) -> Result<Followed> {
    const auto direct = solver::solve_direct(matrix.x, params_.coupling_constant);
    if (!direct.ok()) {
        return direct.status();
    }
    Pose pose{direct->range_m, direct->direction, direct->attitude};
    if (hemisphere_.must_turn(pose.range_m * pose.direction, matrix.newest)) {
        pose.direction = -pose.direction;
    }
    return Followed{pose, to_angles(pose)};
}

template <typename Scalar>
Scalar Tracker<Scalar>::misfit_squared(const Mat3<Scalar>& x, const Pose& pose) const {
    const Scalar k = field::coupling_strength(params_.coupling_constant, pose.range_m);
    return (x - k * pose.attitude * field::dipole_factor(pose.direction)).squaredNorm();
}

/// Fills in the pose with covariance and diagnostics, and adds the flags that depend on it.
template <typename Scalar>
void Tracker<Scalar>::judge(const SignalMatrix<Scalar>& matrix, const Pose& pose, PoseEstimate<Scalar>& estimate) const {
    const Scalar k = field::coupling_strength(params_.coupling_constant, pose.range_m);
    const Scalar misfit = misfit_squared(matrix.x, pose);
    const Scalar snr = k / matrix.sigma;
    estimate.position_m = pose.range_m * pose.direction;
    estimate.q_source_sensor = geometry::attitude_quaternion(pose.attitude);
    estimate.covariance = solver::pose_covariance(k, pose.range_m, pose.direction, matrix.sigma);
    estimate.distortion_chi_square = misfit / (matrix.sigma * matrix.sigma);
    estimate.snr_db = 20 * std::log10(snr);
    estimate.flags.set_if(matrix.x.determinant() < 0, PoseFlag::wrong_handedness);
    estimate.flags.set_if(snr < params_.min_snr, PoseFlag::low_signal);
    const bool significant = estimate.distortion_chi_square > params_.distortion_gate;
    estimate.flags.set_if(significant, PoseFlag::distorted);
    estimate.flags.set_if(significant && misfit > params_.max_misfit * matrix.x.squaredNorm(), PoseFlag::no_sensor);
}

/// The error model's budget for this pose, with the motion as the poses show it and the columns' ages as they are.
template <typename Scalar>
void Tracker<Scalar>::predict_error(const SignalMatrix<Scalar>& matrix, error_model::SolverForm form,
                                    PoseEstimate<Scalar>& estimate) {
    const auto motion = motion_.add(estimate.time, estimate.position_m, estimate.q_source_sensor, params_.lost_after);
    if (!motion) {
        return;
    }
    error_model::BudgetParams<Scalar> budget;
    budget.timing.update_s = seconds_as<Scalar>(estimate.time - last_estimate_.time);
    budget.timing.column_age_s = matrix.column_age_s;
    budget.timing.window_s = params_.window_s;
    budget.timing.latency_s = params_.latency_s;
    budget.solver = form;
    budget.passes = params_.passes;
    const Scalar k = field::coupling_strength(params_.coupling_constant, estimate.position_m.norm());
    estimate.predicted_error = error_model::error_budget(*motion, matrix.sigma / k, budget);
}

/// searching -> tracking on a valid pose; tracking -> lost after lost_after without one; lost -> searching after search_after.
template <typename Scalar>
void Tracker<Scalar>::advance(bool valid, DeviceTime time) {
    if (valid) {
        counters_.acquisitions += state_ == TrackerState::tracking ? 0U : 1U;
        state_ = TrackerState::tracking;
        last_valid_ = time;
        return;
    }
    motion_.clear();
    const Microseconds age = time - last_valid_;
    if (state_ == TrackerState::tracking && age > params_.lost_after) {
        state_ = TrackerState::lost;
    }
    if (state_ == TrackerState::lost && age > params_.search_after) {
        state_ = TrackerState::searching;
        has_last_ = false;
    }
}

template Status check(const TrackerParams<float>&);
template Status check(const TrackerParams<double>&);
template class Tracker<float>;
template class Tracker<double>;

}  // namespace tricoil::tracking

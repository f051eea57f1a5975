#include "core/tracking/matrix/matrix_tracker.hpp"

#include <algorithm>
#include <cmath>

#include "core/base/precision.hpp"
#include "core/field/induced_field.hpp"
#include "core/solver/direct_near_metal.hpp"
#include "core/solver/pose_covariance.hpp"
#include "core/tracking/judge/body_motion.hpp"
#include "core/tracking/judge/signal_flags.hpp"

namespace tricoil::tracking {
namespace {

/// True if the pose shows on which side the sensor is, or would be if the last pose did: it has no fault, and is much nearer than
/// its mirror image.
template <typename Scalar>
bool shows_side(const PoseEstimate<Scalar>& estimate) {
    constexpr Scalar kDeviations = 4;
    PoseFlags others = estimate.flags;
    others.clear(PoseFlag::uncertain);
    others.clear(PoseFlag::hemisphere_unknown);
    return !others.has_any(kInvalidating) && kDeviations * deviation_m(estimate) < estimate.position_m.norm();
}

template <typename Scalar>
Mat3<Scalar> induced_couplings(const field::InducedDipoles<Scalar>& metal, const solver::VectorPose<Scalar>& pose) {
    return field::induced_couplings<Scalar>(metal, pose.range_m * pose.direction, pose.attitude);
}

}  // namespace

template <typename Scalar>
MatrixTracker<Scalar>::MatrixTracker(const CommonParams<Scalar>& params, bool deskew, Step step, const Correction& correction)
    : Tracker<Scalar>(params, correction, Microseconds{0}),
      deskew_(deskew),
      step_(step),
      assembler_(params.max_column_span, deskew),
      motion_(params.max_column_span.count() > 0 ? kSourceCoils : 1),
      hemisphere_(this->params().hemisphere, params.confined),
      column_motion_(params) {}

template <typename Scalar>
void MatrixTracker<Scalar>::do_set_hemisphere(const Vec3<Scalar>& towards) {
    hemisphere_.set(towards);
    if (solved_.position_m.dot(towards) < 0) {
        solved_.position_m = -solved_.position_m;
    }
    if (last_.direction.dot(towards) < 0) {
        last_.direction = -last_.direction;
        motion_.clear();  // the next pose is on the other side: the difference is not motion
    }
}

template <typename Scalar>
std::optional<PoseEstimate<Scalar>> MatrixTracker<Scalar>::do_update(const Column<Scalar>& column, bool /*is_late*/) {
    if (const auto curvature = column_motion_.add(column)) {
        curvatures_[static_cast<std::size_t>(coil_index(column.state))] = *curvature;
    }
    if (!signal_flags(column.flags).has_any(kFaultFlags)) {
        noise_.add(column);
    }
    auto matrix = assembler_.add(column);
    if (!matrix) {
        return std::nullopt;
    }
    matrix->sigma *= std::sqrt(noise_.excess());
    matrix->quadrature_variance *= noise_.excess();
    PoseEstimate<Scalar> estimate;
    estimate.sensor = column.sensor;
    estimate.time = matrix->newest;
    estimate.signal_matrix = matrix->x;
    estimate.flags = signal_flags(matrix->flags);
    Result<Pose> solved = step(matrix->x);
    const bool stepped = solved.ok();
    if (stepped) {
        hemisphere_.step_to(solved->range_m * solved->direction, matrix->newest);
    } else {
        solved = acquire(*matrix);
    }
    if (solved.ok()) {
        fill_estimate(*matrix, *solved, stepped, estimate);
        estimate.flags.set_if(!hemisphere_.known(), PoseFlag::hemisphere_unknown);
    } else {
        estimate.flags.set(solved.status().code() == StatusCode::degenerate ? PoseFlag::no_sensor : PoseFlag::not_converged);
        clear_position(estimate);
    }
    const bool jumped = !is_continuation(estimate);
    estimate.flags.set_if(jumped || (deskew_ && !column_motion_.known()), PoseFlag::unconfirmed);
    flag_recent_faults(estimate, jumped && solved_.exists);
    if (solved.ok() && !estimate.flags.has_any(kFaultFlags)) {
        solved_ = {estimate.position_m, deviation_m(estimate), estimate.time, true};
    }
    if (estimate.valid()) {
        last_ = *solved;
    }
    if (shows_side(estimate)) {
        hemisphere_.follow(estimate.position_m, estimate.time);
    }
    if (estimate.valid()) {
        predict_error(*matrix, stepped ? step_ : Step{}, estimate);
    } else {
        motion_.clear();
    }
    do_refine(assembler_, estimate);
    this->count(estimate, estimate.time, estimate.time);
    if (estimate.valid()) {
        last_estimate_ = estimate;
    }
    return estimate;
}

template <typename Scalar>
std::optional<PoseEstimate<Scalar>> MatrixTracker<Scalar>::do_tick(DeviceTime now) {
    if (!this->is_stale(now)) {
        return std::nullopt;
    }
    motion_.clear();
    PoseEstimate<Scalar> estimate = last_estimate_;
    estimate.flags.set(PoseFlag::stale);
    this->count(estimate, estimate.time, now);
    return estimate;
}

template <typename Scalar>
void MatrixTracker<Scalar>::do_restart(DeviceTime /*now*/) {
    assembler_.clear();
    motion_.clear();
    noise_.restart();
    forget_column_motion();
    solved_.exists = false;
    hemisphere_.forget();
}

/// A fault is neither motion nor metal. Poses are unconfirmed until the motion is known again, which takes two more matrices.
/// Deskew uses a bad column, also of a jump, in later matrices too, where it can stay undetected: two further columns of each
/// state.
template <typename Scalar>
void MatrixTracker<Scalar>::flag_recent_faults(PoseEstimate<Scalar>& estimate, bool jumped) {
    const int history = deskew_ ? 2 * kSourceCoils : 2;
    const bool faulty = estimate.flags.has_any(kFaultFlags);
    if (faulty) {
        forget_column_motion();
        misfit_ = {};
    }
    estimate.flags.set_if(unconfirmed_ > 0, PoseFlag::unconfirmed);
    unconfirmed_ = faulty || (deskew_ && jumped) ? history : std::max(unconfirmed_ - 1, 0);
}

/// The method's step from the last pose. not_ready: no last pose, or the method has no step. not_converged: the step is too large
/// for its linearisation, which alone would make the pose uncertain, or the misfit of its result is too large for a sensor.
template <typename Scalar>
auto MatrixTracker<Scalar>::step(const Mat3<Scalar>& x) -> Result<Pose> {
    if (this->state() != TrackerState::tracking) {
        return Status{StatusCode::not_ready, "no previous pose"};
    }
    const Result<Pose> next = this->surroundings() == nullptr ? do_step(x, last_) : step_near_metal(x);
    if (next.ok() && misfit_squared(x, *next) > this->params().max_misfit * x.squaredNorm()) {
        return Status{StatusCode::not_converged, "the step from the last pose does not explain the couplings"};
    }
    if (next.ok() && position_deviation(Scalar(1), next->range_m, linearization_share(*next)) > this->params().max_deviation_m) {
        return Status{StatusCode::not_converged, "the step from the last pose is too large"};
    }
    return next;
}

/// The method's step without the couplings of metal at the pose that the step gives.
template <typename Scalar>
auto MatrixTracker<Scalar>::step_near_metal(const Mat3<Scalar>& x) -> Result<Pose> {
    constexpr int kSteps = 5;  // each reduces the error of the metal's couplings to a third or less
    Result<Pose> next = last_;
    for (int n = 0; n < kSteps && next.ok(); ++n) {
        next = do_step(x - induced_couplings(*this->surroundings(), *next), last_);
    }
    return next;
}

/// Direct solution, in the hemisphere from continuity or setting.
template <typename Scalar>
auto MatrixTracker<Scalar>::acquire(const SignalMatrix<Scalar>& matrix) -> Result<Pose> {
    const auto direct = solver::solve_direct(matrix.x, this->params().coupling_constant);
    if (!direct.ok()) {
        return direct.status();
    }
    Pose pose{direct->range_m, direct->direction, direct->attitude};
    if (hemisphere_.must_mirror(pose.range_m * pose.direction, matrix.newest)) {
        pose.direction = -pose.direction;
    }
    if (this->surroundings() == nullptr) {
        return pose;
    }
    const auto solved = solver::solve_near_metal<Scalar>(*this->surroundings(), matrix.x, this->params().coupling_constant,
                                                         pose.range_m * pose.direction, pose.attitude);
    if (!solved.ok()) {
        return solved.status();
    }
    return Pose{solved->range_m, solved->direction, solved->attitude};
}

template <typename Scalar>
Scalar MatrixTracker<Scalar>::misfit_squared(const Mat3<Scalar>& x, const Pose& pose) const {
    const Scalar k = field::coupling_strength(this->params().coupling_constant, pose.range_m);
    Mat3<Scalar> rest = x - k * pose.attitude * field::dipole_factor(pose.direction);
    if (this->surroundings() != nullptr) {
        rest -= induced_couplings(*this->surroundings(), pose);
    }
    return rest.squaredNorm();
}

/// Linearization error of a step from the last pose to `pose`, per coupling and relative to k: second order in the change of
/// direction, relative range and attitude (their squared norms; |dO|^2 is twice the squared angle). A second pass removes it.
template <typename Scalar>
Scalar MatrixTracker<Scalar>::linearization_share(const Pose& pose) const {
    constexpr Scalar kSecondOrder = Scalar(0.7);  // from the errors of the simulated hand
    const Scalar range_change = pose.range_m / last_.range_m - 1;
    return step_.passes > 1 ? Scalar(0)
                            : kSecondOrder * ((pose.direction - last_.direction).squaredNorm() + range_change * range_change +
                                              (pose.attitude - last_.attitude).squaredNorm() / 2);
}

/// Fills in the pose with covariance and diagnostics, and adds the flags that depend on it.
template <typename Scalar>
void MatrixTracker<Scalar>::fill_estimate(const SignalMatrix<Scalar>& matrix, const Pose& pose, bool stepped,
                                          PoseEstimate<Scalar>& estimate) {
    const Scalar k = field::coupling_strength(this->params().coupling_constant, pose.range_m);
    const Scalar misfit = misfit_squared(matrix.x, pose);
    const Scalar snr = k / matrix.sigma;
    estimate.position_m = pose.range_m * pose.direction;
    estimate.q_source_sensor = geometry::attitude_quaternion(pose.attitude);
    const Scalar linearization = stepped ? k * linearization_share(pose) : Scalar(0);
    const Scalar still = matrix.sigma * matrix.sigma + this->params().calibration_variance(k);
    const Scalar variance =
        still + column_motion_.error_variance(matrix, this->params().window_s) + linearization * linearization;
    // A step is not a least-squares fit, so its misfit contains some of the pose's noise (simulated: 1.16 times the misfit of a
    // fit).
    constexpr Scalar kStepMisfit = Scalar(1.16);
    const Scalar expected = stepped ? kStepMisfit * variance : variance;
    estimate.distortion_chi_square = misfit / expected;
    estimate.snr_db = 20 * std::log10(snr);
    estimate.flags.set_if(matrix.x.determinant() < 0, PoseFlag::wrong_handedness);
    estimate.flags.set_if(snr < this->params().min_snr, PoseFlag::low_signal);
    const bool significant = estimate.distortion_chi_square > this->params().distortion_gate;
    estimate.flags.set_if(significant && misfit > this->params().max_misfit * matrix.x.squaredNorm(), PoseFlag::no_sensor);
    const bool has_quadrature = judge_quadrature(matrix, k, estimate.flags);
    estimate.flags.set_if((significant || has_quadrature) && column_motion_.known(), PoseFlag::distorted);
    if (unconfirmed_ == 0) {  // a fault is not metal
        const Scalar metal = estimate.flags.has_any(kFaultFlags) ? Scalar(0) : misfit;
        misfit_.add(metal, expected, still, this->params().distortion_gate, matrix.newest);
    }
    const Scalar shown = quadrature_.variance();
    estimate.distortion_m = likely_distortion(k, pose.range_m, std::sqrt(std::max(misfit_.variance(), shown)));
    const Scalar metal = std::max(misfit_.covered_variance(), shown);
    estimate.covariance = solver::pose_covariance<Scalar>(k, pose.range_m, pose.direction, std::sqrt(variance + metal));
    estimate.flags.set_if(!(deviation_m(estimate) <= this->params().max_deviation_m), PoseFlag::uncertain);
}

/// True if the quadrature shows metal. Faults, columns of unknown phase and unknown motion cause a quadrature too. flags: those
/// of the columns (signal_flags()) and of the pose so far.
template <typename Scalar>
bool MatrixTracker<Scalar>::judge_quadrature(const SignalMatrix<Scalar>& matrix, Scalar strength, PoseFlags flags) {
    const bool is_faulty = unconfirmed_ > 0 || flags.has_any(kFaultFlags | PoseFlags{PoseFlag::unconfirmed});
    if (is_faulty || !column_motion_.known()) {
        quadrature_.clear();
        return false;
    }
    return quadrature_.add(matrix, strength, column_motion_, this->params());
}

/// True if the last solved pose is near enough in time and place for the motion of a body.
template <typename Scalar>
bool MatrixTracker<Scalar>::is_continuation(const PoseEstimate<Scalar>& estimate) const {
    constexpr Scalar kDeviations = 5;
    const Microseconds step = estimate.time - solved_.time;
    if (!solved_.exists || step > this->params().lost_after) {
        return false;
    }
    const Scalar reach_m =
        Scalar(kMaxBodySpeed_m_s) * seconds_as<Scalar>(step) + kDeviations * (deviation_m(estimate) + solved_.deviation_m);
    return (estimate.position_m - solved_.position_m).squaredNorm() <= reach_m * reach_m;
}

/// Error budget of this pose, with motion from the poses and the actual ages of the columns.
template <typename Scalar>
void MatrixTracker<Scalar>::predict_error(const SignalMatrix<Scalar>& matrix, Step step, PoseEstimate<Scalar>& estimate) {
    const auto motion = motion_.add(estimate.time, estimate.position_m, estimate.q_source_sensor, this->params().lost_after);
    if (!motion) {
        return;
    }
    error_model::BudgetParams<Scalar> budget;
    budget.timing.update_s = seconds_as<Scalar>(estimate.time - last_estimate_.time);
    budget.timing.column_age_s = matrix.column_age_s;
    budget.timing.window_s = this->params().window_s;
    budget.timing.latency_s = this->params().latency_s;
    budget.solver = step.form;
    budget.passes = step.passes;
    auto errors = error_model::systematic_errors(*motion, budget);
    // Deskew leaves the curvature of the couplings, which the columns show.
    const auto extrapolation = column_motion_.extrapolation(matrix, curvatures_);
    errors.skew += error_model::matrix_error<Scalar>(*motion, extrapolation.missing / this->params().coupling_constant);
    const Scalar range_m = estimate.position_m.norm();
    const Scalar k = field::coupling_strength(this->params().coupling_constant, range_m);
    const Scalar variance = matrix.sigma * matrix.sigma + floor_variance(this->params(), k);
    estimate.predicted_error = error_model::budget_of<Scalar>(
        errors, solver::pose_covariance<Scalar>(k, range_m, estimate.position_m / range_m, std::sqrt(variance)),
        extrapolation.variance / variance);
}

template <typename Scalar>
void MatrixTracker<Scalar>::forget_column_motion() {
    column_motion_.clear();
    curvatures_ = {};
}

#if TRICOIL_SCALARS & 1  // float
template class MatrixTracker<float>;
#endif
#if TRICOIL_SCALARS & 2  // double
template class MatrixTracker<double>;
#endif

}  // namespace tricoil::tracking

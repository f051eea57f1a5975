// Definitions of Filter. Include only where it is instantiated for a field model.
#pragma once

#include <limits>
#include <utility>

#include "core/geometry/angles.hpp"
#include "core/solver/pose_covariance.hpp"
#include "core/tracking/scaat/estimator_impl.hpp"
#include "core/tracking/scaat/filter.hpp"
#include "core/tracking/scaat/report.hpp"

namespace tricoil::tracking::scaat {

/// True if a pose with these flags can show its side of the source: it is that of a sensor, converged and confirmed.
constexpr bool may_show_side(PoseFlags flags) {
    flags.clear(PoseFlag::uncertain);
    flags.clear(PoseFlag::hemisphere_unknown);
    return !flags.has_any(kInvalidating);
}

template <typename Scalar, MeasurementModel<Scalar> Model>
Filter<Scalar, Model>::Filter(const CommonParams<Scalar>& common, const ScaatParams<Scalar>& params, const Model& model,
                              const Correction& correction)
    : Tracker<Scalar>(common, correction, params.max_lateness),
      params_(params),
      model_(model),
      intake_(common.max_column_span),
      estimator_(params_, model_, this->counters_),
      health_(this->params(), model_),
      hemisphere_(this->params().hemisphere, common.confined),
      horizon_(params.predict_ahead) {
    if constexpr (requires { model_.surroundings; }) {
        model_.surroundings = Tracker<Scalar>::surroundings();
    }
}

template <typename Scalar, MeasurementModel<Scalar> Model>
auto Filter<Scalar, Model>::do_update(const Column<Scalar>& column, bool is_late) -> Pose {
    sensor_ = column.sensor;
    if (is_running_ && !is_late) {
        // Without this coil the state may have moved to a false solution, so the filter does not continue from it.
        const bool returns = estimator_.history().silence(coil_index(column.state), column.midpoint) > params_.coast_limit;
        if (returns || estimator_.history().silence(column.midpoint) > this->params().lost_after) {
            stop();
        }
    }
    if (!is_running_) {
        return search(column);
    }
    return intake_.in_frames() && column.midpoint >= motion().time ? track_frame(column) : track_column(column);
}

template <typename Scalar, MeasurementModel<Scalar> Model>
auto Filter<Scalar, Model>::track_column(const Column<Scalar>& column) -> Pose {
    const bool in_order = column.midpoint >= motion().time;
    if (in_order) {
        intake_.note_flags(column);
        estimator_.propagate_to(column.midpoint);
    }
    if (column.flags.has_any(kUnusable)) {
        return finish_measurement(false);
    }
    health_.note(column);
    const bool complete = in_order && intake_.note(column);
    const bool accepted = use(column, motion(), trust_of_several());
    estimator_.history().measured(accepted);
    if (accepted && health_.take(column, estimator_.may_deskew())) {
        compare_with_columns();
    }
    return intake_.in_frames() ? std::nullopt : finish_measurement(complete);
}

/// Processes one of three simultaneous columns. A complete frame is used as a whole; an incomplete frame when the next one
/// begins.
template <typename Scalar, MeasurementModel<Scalar> Model>
auto Filter<Scalar, Model>::track_frame(const Column<Scalar>& column) -> Pose {
    if (column.midpoint > motion().time && intake_.has_waiting()) {
        return end_frame(column);
    }
    const std::optional<SignalMatrix<Scalar>> matrix = take_into_frame(column);
    if (!this->frame_is_over()) {
        return std::nullopt;
    }
    if (matrix) {
        intake_.clear_waiting();
        estimator_.history().measured(use_frame(*matrix));
    } else {
        use_waiting();
    }
    return finish_measurement(matrix.has_value());
}

template <typename Scalar, MeasurementModel<Scalar> Model>
auto Filter<Scalar, Model>::end_frame(const Column<Scalar>& next) -> Pose {
    use_waiting();
    auto ended = finish_measurement(false);
    (void)take_into_frame(next);
    return ended;
}

/// Moves the state to the column's time. Returns the signal matrix if this column completes the frame.
template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<SignalMatrix<Scalar>> Filter<Scalar, Model>::take_into_frame(const Column<Scalar>& column) {
    if (!is_running_) {              // it stopped at the previous frame
        return intake_.add(column);  // keep the column for the frame's signal matrix
    }
    if (column.midpoint > motion().time) {
        estimator_.propagate_to(column.midpoint);
    }
    intake_.note_flags(column);
    if (!intake_.wait_for_frame(column)) {
        return std::nullopt;
    }
    health_.note(column);
    return intake_.add(column);
}

template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::use_waiting() {
    for (int j = 0; j < kSourceCoils; ++j) {
        if (intake_.is_waiting(j)) {
            estimator_.history().measured(use(intake_.columns().latest(j), motion(), trust_of_several()));
        }
    }
    intake_.clear_waiting();
}

/// Uses three simultaneous columns. The model is linearised at their direct pose, so the accuracy does not depend on the
/// prediction. Nine numbers that agree on a pose are not outliers: if they contradict the prediction, its covariance is inflated
/// at once. A remaining misfit may be blur or metal. Returns false if most columns are refused or the state does not reach the
/// direct pose.
template <typename Scalar, MeasurementModel<Scalar> Model>
[[gnu::noinline]] bool Filter<Scalar, Model>::use_frame(const SignalMatrix<Scalar>& matrix) {
    const auto pose = health_.examine(matrix, &motion());
    Motion<Scalar> around = motion();
    const bool agree = pose.ok() && health_.is_sensor() && is_evenly_noisy();
    if (agree) {
        around.position_m = pose->position_m;
        around.q_source_sensor = geometry::attitude_quaternion(pose->attitude);
    }
    Trust trust = agree ? Trust::agree : Trust::none;
    int refused = 0;
    for (int j = 0; j < kSourceCoils; ++j) {
        const Motion<Scalar>& at = agree ? around : static_cast<const Motion<Scalar>&>(motion());
        refused += use(intake_.columns().latest(j), at, trust) ? 0 : 1;
        trust = agree && refused == 0 ? Trust::near : trust;
    }
    return 2 * refused < kSourceCoils && (!agree || is_within_gate(*pose, matrix.sigma));
}

template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::use(const Column<Scalar>& column, const Motion<Scalar>& around, Trust trust) {
    // Share of the blur that does not have the form of a pose error, from the recorded motions and the paper's example III. A
    // larger value makes the filter lag behind the direct pose, a smaller one makes it refuse columns.
    constexpr double kUnmodelledBlur = 0.1;
    const Scalar unmodelled = Scalar(kUnmodelledBlur * kUnmodelledBlur) * health_.blur_variance();
    // In TDM the residual is one frame old; near metal it changes with the motion.
    constexpr double kResidualChange = 0.3;
    const Vec3<Scalar> residual = health_.residual(coil_index(column.state));
    const Scalar change =
        intake_.in_frames() ? Scalar(0) : Scalar(kResidualChange * kResidualChange / 3) * residual.squaredNorm();
    const Scalar variance = unmodelled + change + health_.start_variance() + health_.unremoved_variance();
    return estimator_.use(column, around, {trust, intake_.in_frames(), {variance, residual}});
}

/// Compares the state with the pose of the last columns, deskewed without the filter. In TDM the state can follow a motion that
/// repeats with every frame and fits each column alone: near metal such an oscillation grew to 58 mm.
template <typename Scalar, MeasurementModel<Scalar> Model>
[[gnu::noinline]] void Filter<Scalar, Model>::compare_with_columns() {
    const SignalMatrix<Scalar> matrix = health_.accepted().matrix();
    const auto pose = health_.examine(matrix, &motion());
    if (!pose.ok() || !health_.is_sensor() || matrix.newest != motion().time || pose->position_m.dot(motion().position_m) < 0) {
        return;
    }
    // Two axes have nearly the same variance, the third a much smaller one, so half the sum is the largest.
    const Scalar direct_m = position_deviation(pose->strength, pose->position_m.norm(), std::sqrt(health_.pose_variance()));
    const Scalar variance = (motion().covariance.template topLeftCorner<3, 3>().trace() + direct_m * direct_m) / 2;
    const bool beyond = (pose->position_m - motion().position_m).squaredNorm() > params_.gate * variance;
    estimator_.history().compared(!beyond);
}

/// True if the nine noise values are similar enough for the direct pose, which gives all nine numbers equal weight.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::is_evenly_noisy() const {
    constexpr Scalar kMaxUneven = 30;
    Scalar least = std::numeric_limits<Scalar>::max();
    Scalar most = 0;
    for (int j = 0; j < kSourceCoils; ++j) {
        least = std::min(least, intake_.columns().latest(j).sigma.minCoeff());
        most = std::max(most, intake_.columns().latest(j).sigma.maxCoeff());
    }
    return most <= kMaxUneven * least;
}

/// True if the state is within the gate of the direct pose of the columns just used.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::is_within_gate(const StartPose<Scalar>& pose, Scalar sigma) const {
    const Scalar range = pose.position_m.norm();
    const Mat6<Scalar> direct = solver::pose_covariance<Scalar>(pose.strength, range, pose.position_m / range,
                                                                std::sqrt(sigma * sigma + health_.blur_variance()));
    return estimator_.is_within_gate(pose.position_m, direct.template topLeftCorner<3, 3>());
}

/// Report after a measurement. If the filter has lost the sensor and the measurement completes a signal matrix, the filter starts
/// again from its three columns.
template <typename Scalar, MeasurementModel<Scalar> Model>
auto Filter<Scalar, Model>::finish_measurement(bool has_matrix) -> Pose {
    PoseFlags flags = intake_.flags();
    if (estimator_.history().has_lost_sensor() || !is_possible(motion())) {
        ++this->counters_.reacquisitions;
        if (!has_matrix || !start(intake_.columns().matrix())) {
            stop();
            flags |= health_.flags();
        } else if (!intake_.in_frames()) {
            estimator_.history().inflate();  // one of the three may be an outlier
        }
        flags.set(PoseFlag::unconfirmed);
    }
    return report(flags, params_.predict_ahead, motion().time);
}

template <typename Scalar, MeasurementModel<Scalar> Model>
auto Filter<Scalar, Model>::search(const Column<Scalar>& column) -> Pose {
    const auto matrix = intake_.add(column);
    if (!matrix) {
        return std::nullopt;
    }
    return acquire(*matrix, column.midpoint);
}

template <typename Scalar, MeasurementModel<Scalar> Model>
[[gnu::noinline]] auto Filter<Scalar, Model>::acquire(const SignalMatrix<Scalar>& matrix, DeviceTime time) -> Pose {
    const PoseFlags flags = signal_flags(matrix.flags);
    const bool started = !matrix.flags.has_any(kUnusable) && start(matrix);
    auto estimate = report(started ? flags : flags | health_.flags(), started ? params_.predict_ahead : Microseconds{0}, time);
    if (!started) {
        estimate->time = time;
    }
    return estimate;
}

/// Starts tracking from the three columns of `matrix`. False if they give no pose; the reason is in health_.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::start(const SignalMatrix<Scalar>& matrix) {
    const auto pose = health_.examine(matrix, nullptr);
    if (!pose.ok() || !health_.is_sensor()) {
        return false;
    }
    StartPose<Scalar> chosen = *pose;
    resolve_hemisphere(chosen, matrix);
    estimator_.start(chosen, rates_since_last_start(chosen, matrix.newest), intake_.columns(), health_.start_variance());
    is_running_ = true;
    is_new_ = !pose->hemisphere_from_data;
    ++starts_;
    health_.start();
    intake_.start();
    return true;
}

/// Rates of a sensor that is too fast for a start at rest: the filter lost it within two frames of the last start. Both poses
/// have the same skew, so their difference does not contain it. Empty for a sensor at usual speed, and for simultaneous columns.
template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<StartRates<Scalar>> Filter<Scalar, Model>::rates_since_last_start(const StartPose<Scalar>& pose, DeviceTime time) {
    const TimedPose<Scalar> before =
        std::exchange(last_start_, {time, pose.position_m, geometry::attitude_quaternion(pose.attitude), true});
    const auto motion = motion_between(before, last_start_, 2 * this->params().max_column_span);
    if (!motion || (motion->velocity_m_s.norm() <= params_.start_speed_m_s &&
                    motion->angular_rate_rad_s.norm() <= params_.start_rate_rad_s)) {
        return std::nullopt;
    }
    return StartRates<Scalar>{motion->velocity_m_s, motion->angular_rate_rad_s};
}

/// Sign of the position: from the model if it can determine it, otherwise from the setting or by continuity.
template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::resolve_hemisphere(StartPose<Scalar>& pose, const SignalMatrix<Scalar>& matrix) {
    if (pose.hemisphere_from_data) {
        hemisphere_.resolved_by_data();
        return;
    }
    if (!hemisphere_.must_mirror(pose.position_m, matrix.newest)) {
        return;
    }
    pose.position_m = -pose.position_m;
    if (!model_.is_even()) {  // refine from the mirror image, which is only approximately a solution
        const auto turned = model_.near(matrix.x, pose.position_m, geometry::attitude_quaternion(pose.attitude));
        pose = turned.ok() && turned->position_m.dot(pose.position_m) > 0 ? *turned : pose;
    }
}

/// Replaces the state by its mirror image. Where X is not even, the mirror image is not a solution, so the filter searches again.
template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::turn_around() {
    horizon_.restart();
    if (model_.is_even()) {
        estimator_.mirror_state();
    } else {
        stop();
    }
}

/// A pose whose deviation is a large part of the range, beside metal, may pass to the other side of the source. So may the state
/// after a start from columns with a fault. When the pose is accurate, the last good pose decides, or the couplings if they
/// depend on the side. Returns false if the state was turned, so that the present pose is on the wrong side.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::continue_side(Scalar deviation_m) {
    constexpr Scalar kVagueShare = Scalar(0.5);
    const Vec3<Scalar>& position_m = motion().position_m;
    const bool was_vague = std::exchange(is_vague_, !(deviation_m <= kVagueShare * position_m.norm()));
    if (is_vague_) {
        hemisphere_.see(position_m, motion().time);
        return true;
    }
    const bool was_new = std::exchange(is_new_, false);
    const bool turn =
        (was_vague && !model_.is_even()) || ((was_vague || was_new) && hemisphere_.must_mirror(position_m, motion().time));
    if (turn) {
        turn_around();
        if (!model_.is_even()) {
            return false;  // the state is not mirrored
        }
    }
    is_new_ = was_new && !hemisphere_.known() && !(deviation_m <= this->params().max_deviation_m);  // decided again
    if (!is_new_) {
        hemisphere_.follow(motion().position_m, motion().time);
    }
    return !turn;
}

template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::stop() {
    if (is_running_) {
        is_running_ = false;
        health_.forget_columns();
    }
}

template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::do_restart(DeviceTime now) {
    is_running_ = false;
    intake_.forget();
    health_.forget_times();
    hemisphere_.forget();
    estimator_.set_last_used(now);
}

/// Moves a copy of the state ahead. True if this is a prediction, corrected with the errors of earlier ones over the same time;
/// not while only columns are missing, and not until the acceleration is known.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::predict(State<Scalar>& later, Microseconds ahead, bool coasting) {
    if (params_.predict_ahead.count() == 0 || !is_running_ || !estimator_.is_learning()) {
        horizon_.restart();
        propagate(later, estimator_.intensity(), later.time + ahead);
        return false;
    }
    scaat::predict(later, estimator_.intensity(), later.time + ahead);
    const bool is_confirmed = estimator_.history().confirmed();
    horizon_.compare(motion(), is_confirmed, this->counters_.covariance_inflations);
    horizon_.correct(later, motion().covariance, estimator_.reported_factor(), is_confirmed && !coasting);
    return true;
}

/// Always contains a value. The optional lets callers return it without a copy.
template <typename Scalar, MeasurementModel<Scalar> Model>
auto Filter<Scalar, Model>::report(PoseFlags flags, Microseconds ahead, DeviceTime now) -> Pose {
    std::optional<State<Scalar>> later;
    const bool coasting = flags.has(PoseFlag::coasting);
    const bool is_prediction = ahead.count() > 0 && predict(later.emplace(motion()), ahead, coasting);
    const State<Scalar>& state = later ? *later : motion();
    Pose reported(std::in_place);
    PoseEstimate<Scalar>& estimate = *reported;
    report_state(estimate, state, estimator_, health_, flags);
    estimate.sensor = sensor_;
    const bool silent = estimator_.history().silence(motion().time) > params_.coast_limit;
    estimate.flags.set_if(!is_running_ || silent, PoseFlag::stale);
    cover_misfit(estimate, health_);
    // Without the growth over the time of the prediction; that over missing columns counts.
    const auto variance = [](const auto& p) { return p.template topLeftCorner<3, 3>().trace(); };
    const Scalar grown = is_prediction && !coasting
                             ? estimator_.reported_factor() * (variance(later->covariance) - variance(motion().covariance))
                             : Scalar(0);
    const auto measured_deviation_m = [&] { return std::sqrt(std::max(variance(estimate.covariance) - grown, Scalar(0))); };
    if (may_show_side(estimate.flags) && !continue_side(measured_deviation_m())) {
        estimate.flags.set(PoseFlag::unconfirmed);
    }
    estimate.flags.set_if(!hemisphere_.known(), PoseFlag::hemisphere_unknown);
    if (estimate.valid()) {
        estimate.predicted_error = expected_error(state, estimate.covariance, this->params());
        cover_blur(estimate);
    }
    estimate.flags.set_if(!(measured_deviation_m() <= this->params().max_deviation_m), PoseFlag::uncertain);
    this->count(estimate, motion().time, now);
    return reported;
}

template <typename Scalar, MeasurementModel<Scalar> Model>
auto Filter<Scalar, Model>::do_tick(DeviceTime now) -> Pose {
    if (starts_ == 0) {
        return std::nullopt;
    }
    if (now <= estimator_.last_used()) {
        if (estimator_.last_used() - now <= this->params().lost_after) {
            return std::nullopt;
        }
        return report({PoseFlag::stale}, Microseconds{0}, now);
    }
    if (is_running_) {
        use_waiting();
    }
    const Microseconds age = estimator_.history().silence(now);
    if (!is_running_ || age > this->params().lost_after) {
        stop();
        return report({PoseFlag::stale}, Microseconds{0}, now);
    }
    const Microseconds ahead = now > motion().time ? now - motion().time : Microseconds{0};
    PoseFlags flags{PoseFlag::coasting};
    flags.set_if(age > params_.coast_limit, PoseFlag::stale);
    return report(flags, ahead + params_.predict_ahead, now);
}

template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::do_set_hemisphere(const Vec3<Scalar>& towards) {
    hemisphere_.set(towards);
    if (motion().position_m.dot(towards) < 0) {
        turn_around();
    }
}

}  // namespace tricoil::tracking::scaat

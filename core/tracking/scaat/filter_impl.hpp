// Definitions of Filter; include only where it is instantiated for a field model.
#pragma once

#include <cmath>
#include <numbers>

#include "core/geometry/angles.hpp"
#include "core/solver/pose_covariance.hpp"
#include "core/tracking/scaat/filter.hpp"
#include "core/tracking/signal_flags.hpp"

namespace tricoil::tracking::scaat {

/// Columns that say nothing about the couplings.
constexpr ColumnFlags kUnusable{ColumnFlag::no_reference, ColumnFlag::saturated, ColumnFlag::clipped,
                                ColumnFlag::stuck,        ColumnFlag::overrun,   ColumnFlag::dc_offset};

constexpr unsigned kAllCoils = 7;  // bit each

/// Poses from which the side of the source cannot be continued; those that only wait to be confirmed are near enough for that.
constexpr PoseFlags kDiscontinuous{PoseFlag::saturated,         PoseFlag::no_sensor,    PoseFlag::stale,
                                   PoseFlag::wrong_handedness,  PoseFlag::no_reference, PoseFlag::inconsistent,
                                   PoseFlag::hemisphere_unknown};

template <typename Scalar, MeasurementModel<Scalar> Model>
Status Filter<Scalar, Model>::check(const Params<Scalar>& params, const Model& model) {
    const Status status = scaat::check(params);
    return status.ok() ? model.check() : status;
}

template <typename Scalar, MeasurementModel<Scalar> Model>
Filter<Scalar, Model>::Filter(const Params<Scalar>& params, const Model& model)
    : params_(params),
      model_(model),
      raw_(params.max_column_span),
      accepted_(params.max_column_span, true),
      time_base_(params.max_lateness, params.lost_after),
      hemisphere_(params.hemisphere, params.confined) {
    reset_adaptation();
}

template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<PoseEstimate<Scalar>> Filter<Scalar, Model>::update(const Column<Scalar>& column) {
    bool late = false;
    if (const auto reason = why_refused(column, late)) {
        ++counters_.rejected[static_cast<std::size_t>(*reason)];
        return std::nullopt;
    }
    ++counters_.accepted;
    sensor_ = column.sensor;
    if (mode_ == TrackerState::tracking && !late) {
        // Without this coil the state may have strayed to a false solution: it does not go on from there.
        const bool returns = record_.silence(coil_index(column.state), column.midpoint) > params_.coast_limit;
        if (returns || record_.silence(column.midpoint) > params_.lost_after) {
            lose(column.midpoint);
        }
    }
    if (mode_ != TrackerState::tracking) {
        lose(column.midpoint);
        return search(column);
    }
    return in_frames() && column.midpoint >= state_.time ? follow_frame(column) : track(column);
}

template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<Rejection> Filter<Scalar, Model>::why_refused(const Column<Scalar>& column, bool& late) {
    if (const auto reason = why_unusable(column)) {
        return reason;
    }
    using Verdict = TimeBase::Verdict;
    const Verdict verdict = time_base_.take(coil_index(column.state), column.midpoint, true);
    late = verdict == Verdict::late;
    if (verdict == Verdict::restarted) {
        forget();
        last_used_ = column.midpoint;
    }
    return reason_of(verdict);
}

/// The clock started anew: nothing that was known has a time any more.
template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::forget() {
    ++counters_.clock_restarts;
    mode_ = TrackerState::searching;
    raw_.clear();
    accepted_.clear();
    hemisphere_.forget();
    pending_ = 0;
}

/// One column by itself while tracking.
template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<PoseEstimate<Scalar>> Filter<Scalar, Model>::track(const Column<Scalar>& column) {
    const int coil = coil_index(column.state);
    const bool in_order = column.midpoint >= state_.time;
    if (in_order) {
        flags_of_state_[static_cast<std::size_t>(coil)] = signal_flags(column.flags);
        propagate(state_, intensity(), column.midpoint);
    }
    if (column.flags.has_any(kUnusable)) {
        return judge(std::nullopt);
    }
    const auto raw = in_order ? raw_.add(column) : std::nullopt;
    const bool accepted = use(column, state_, record_.contradicted_beside(coil));
    record_.measured(accepted);
    if (accepted && in_order) {
        const auto matrix = accepted_.add(column);
        const bool deskewed = settled_ >= 3 * kSourceCoils;  // two columns of each state since the start's three
        if (matrix && deskewed && ++since_health_ >= kSourceCoils) {
            since_health_ = 0;
            (void)examine(*matrix, true);  // what it finds stands in health_
        }
    }
    if (in_frames()) {
        return std::nullopt;
    }
    return judge(raw);
}

/// One of three simultaneous columns. They are used together when all have come, and those that came when the next frame begins.
template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<PoseEstimate<Scalar>> Filter<Scalar, Model>::follow_frame(const Column<Scalar>& column) {
    if (column.midpoint > state_.time && pending_ != 0U) {
        return end_frame(column);
    }
    const std::optional<SignalMatrix<Scalar>> raw = take_into_frame(column);
    if (time_base_.coils_at_newest() != kAllCoils) {
        return std::nullopt;
    }
    if (raw) {
        pending_ = 0;
        record_.measured(use_frame(*raw));
    } else {
        use_pending();
    }
    return judge(raw);
}

/// A frame that lacks one or two columns, now that the next one's first has come.
template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<PoseEstimate<Scalar>> Filter<Scalar, Model>::end_frame(const Column<Scalar>& next) {
    use_pending();
    auto ended = judge(std::nullopt);
    (void)take_into_frame(next);
    return ended;
}

/// Moves the state to the column's time; the frame's three columns if this is the last of them.
template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<SignalMatrix<Scalar>> Filter<Scalar, Model>::take_into_frame(const Column<Scalar>& column) {
    if (mode_ != TrackerState::tracking) {  // the frame before could not be followed
        return raw_.add(column);            // the frame's others will find it there
    }
    if (column.midpoint > state_.time) {
        propagate(state_, intensity(), column.midpoint);
    }
    const int coil = coil_index(column.state);
    flags_of_state_[static_cast<std::size_t>(coil)] = signal_flags(column.flags);
    if (column.flags.has_any(kUnusable)) {
        return std::nullopt;
    }
    pending_ |= 1U << static_cast<unsigned>(coil);
    return raw_.add(column);
}

/// The columns of a frame that lacks one or two, each for itself.
template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::use_pending() {
    for (int j = 0; j < kSourceCoils; ++j) {
        if ((pending_ >> static_cast<unsigned>(j) & 1U) != 0U) {
            record_.measured(use(raw_.latest(j), state_, record_.contradicted_beside(j)));
        }
    }
    pending_ = 0;
}

/// What is reported after a measurement; starts anew from the three columns of `raw` if the filter was left behind.
template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<PoseEstimate<Scalar>> Filter<Scalar, Model>::judge(const std::optional<SignalMatrix<Scalar>>& raw) {
    PoseFlags flags = flags_of_state_[0] | flags_of_state_[1] | flags_of_state_[2];
    if (record_.left_behind()) {
        ++counters_.reopened;
        if (!raw || !start(*raw)) {
            lose(state_.time);
            flags |= health_.flags;
        } else if (!in_frames()) {
            record_.open();  // one of the three may be an outlier
        }
        flags.set(PoseFlag::unconfirmed);
    }
    return report(flags, params_.predict_ahead);
}

/// Three simultaneous columns. Their direct pose is where the model is linearised: exact however far the prediction is off. Nine
/// numbers that agree on a pose are no outliers, so a prediction that they contradict is opened at once; what is left over may
/// be blur or metal, but it is a sensor. False if most are refused, or the state does not come to lie beside the direct pose.
template <typename Scalar, MeasurementModel<Scalar> Model>
[[gnu::noinline]] bool Filter<Scalar, Model>::use_frame(const SignalMatrix<Scalar>& matrix) {
    const auto pose = examine(matrix, true);
    Motion<Scalar> around = state_;
    const bool agree =
        pose.ok() && !health_.flags.has_any({PoseFlag::no_sensor, PoseFlag::wrong_handedness}) && is_evenly_noisy();
    if (agree) {
        around.position_m = pose->position_m;
        around.q_source_sensor = geometry::attitude_quaternion(pose->attitude);
    }
    int refused = 0;
    for (int j = 0; j < kSourceCoils; ++j) {
        refused += use(raw_.latest(j), agree ? around : static_cast<const Motion<Scalar>&>(state_), agree) ? 0 : 1;
    }
    return 2 * refused < kSourceCoils && (!agree || is_beside(*pose, matrix.sigma));
}

/// Whether the direct pose, to which all nine numbers count alike, is as good as the best of them allow.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::is_evenly_noisy() const {
    constexpr Scalar kMostUneven = 30;
    Scalar least = raw_.latest(0).sigma.minCoeff();
    Scalar most = raw_.latest(0).sigma.maxCoeff();
    for (int j = 1; j < kSourceCoils; ++j) {
        least = std::min(least, raw_.latest(j).sigma.minCoeff());
        most = std::max(most, raw_.latest(j).sigma.maxCoeff());
    }
    return most <= kMostUneven * least;
}

/// Whether the state lies within the gate of the direct pose of the columns that it has just taken.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::is_beside(const StartPose<Scalar>& pose, Scalar sigma) const {
    const Vec3<Scalar> apart = state_.position_m - pose.position_m;
    const Scalar range = pose.position_m.norm();
    const Mat6<Scalar> direct =
        solver::pose_covariance<Scalar>(pose.strength, range, pose.position_m / range, std::sqrt(sigma * sigma + blur_variance_));
    const Mat3<Scalar> expected = state_.covariance.template topLeftCorner<3, 3>() + direct.template topLeftCorner<3, 3>();
    const Eigen::LLT<Mat3<Scalar>> factors(expected);
    return factors.info() == Eigen::Success && factors.matrixL().solve(apart).squaredNorm() <= params_.gate;
}

/// Updates with a column if it passes the gate, linearised at `around`; with less weight the nearer it comes to the gate: many
/// such columns are outliers too, and a manoeuvre is told again by the next one. (A late column is told by none and keeps its
/// weight.) One that does not pass is left out as an outlier, unless `trusted`: then the sensor has accelerated beyond what was
/// thought possible, and the prediction is opened until it passes.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::use(const Column<Scalar>& column, const Motion<Scalar>& around, bool trusted) {
    const int coil = coil_index(column.state);
    const Scalar restless = Scalar(kRestlessBlur * kRestlessBlur) * blur_variance_;
    auto innovation = column_innovation<Scalar>(model_, state_, around, column, restless);
    const bool far = innovation.y.norm() > params_.most_opened * column.in_phase.norm();
    const bool may_open = trusted && !far && !record_.any_far();
    Vec3<Scalar> whitened = innovation.whitened();
    Scalar nis = whitened.squaredNorm();
    int openings = 0;
    for (; may_open && innovation.ok && nis > params_.gate && openings < kMostOpenings; ++openings) {
        open(nis / 3);
        innovation = column_innovation<Scalar>(model_, state_, around, column, restless);
        whitened = innovation.whitened();
        nis = whitened.squaredNorm();
    }
    if (!innovation.ok || !(nis <= params_.gate)) {
        record_.refuse(coil, far);
        ++counters_.outliers;
        return false;
    }
    record_.accept(coil, column.midpoint);
    if (innovation.late_s <= 0) {
        noise_.add(column);
    }
    if (openings > 0 && !in_frames()) {
        record_.open();
    }
    if (!trusted && innovation.late_s <= 0 && nis > Scalar(kDoubtful)) {
        const Scalar excess = nis / Scalar(kDoubtful);
        weaken(innovation, excess * excess * excess);
    }
    surprise_ = std::max(nis / Scalar(kSurprising), Scalar(kSurpriseKept) * surprise_);
    const bool settled = settled_ >= kSettlingColumns;
    if (settled) {
        adapt(innovation, whitened);
    }
    consistency_ += settled ? params_.consistency_gain * (nis / 3 - consistency_) : Scalar(0);
    const auto gains_per_s = acceleration_gains_per_s(state_.covariance);
    const Vec12<Scalar> correction = apply(state_, innovation);
    if (settled_ >= kLearningColumns) {
        learn_acceleration(state_, correction, gains_per_s);
    }
    last_used_ = std::max(last_used_, column.midpoint);
    settled_ = std::min(settled_ + 1, kLearningColumns);
    return true;
}

/// The restlessness from an innovation as surprising as it was, but with the share in it that the column's weight left.
template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::adapt(const Innovation<Scalar>& innovation, const Vec3<Scalar>& whitened) {
    const auto& n = params_.process;
    const auto share = [&](int block) -> Mat3<Scalar> {
        const Eigen::Matrix<Scalar, 3, 3> h = innovation.h.template middleCols<3>(block);
        const Mat3<Scalar> a = h * state_.covariance.template block<3, 3>(block, block) * h.transpose();
        const Mat3<Scalar> half = solve_columns(innovation.s.matrixL(), a);
        return solve_columns(innovation.s.matrixL(), half.transpose());
    };
    process_.log_translation = std::clamp(adapted_log<Scalar>(process_.log_translation, process_.information_translation,
                                                              process_.score_translation, share(0), whitened, n),
                                          std::log(n.least_m2_s3), std::log(n.most_m2_s3));
    process_.log_rotation = std::clamp(
        adapted_log<Scalar>(process_.log_rotation, process_.information_rotation, process_.score_rotation, share(3), whitened, n),
        std::log(n.least_rad2_s3), std::log(n.most_rad2_s3));
}

/// Multiplies the prediction's covariance, and the intensity that led to it.
template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::open(Scalar factor) {
    const auto& n = params_.process;
    state_.covariance *= factor;
    process_.log_translation = std::min(process_.log_translation + std::log(factor), std::log(n.most_m2_s3));
    process_.log_rotation = std::min(process_.log_rotation + std::log(factor), std::log(n.most_rad2_s3));
    ++counters_.opened;
}

/// One column while searching or lost.
template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<PoseEstimate<Scalar>> Filter<Scalar, Model>::search(const Column<Scalar>& column) {
    const auto matrix = raw_.add(column);
    if (!matrix) {
        return std::nullopt;
    }
    return begin(*matrix, column.midpoint);
}

/// What is reported when a matrix has come while searching.
template <typename Scalar, MeasurementModel<Scalar> Model>
[[gnu::noinline]] std::optional<PoseEstimate<Scalar>> Filter<Scalar, Model>::begin(const SignalMatrix<Scalar>& matrix,
                                                                                   DeviceTime time) {
    const PoseFlags flags = signal_flags(matrix.flags);
    const bool started = !matrix.flags.has_any(kUnusable) && start(matrix);
    auto estimate = report(started ? flags : flags | health_.flags, started ? params_.predict_ahead : Microseconds{0});
    if (!started) {
        estimate->flags.set(PoseFlag::stale);
        estimate->time = time;
    }
    return estimate;
}

/// Begins to track from the three columns of `matrix`; false, with the reason in health_, if they are no pose.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::start(const SignalMatrix<Scalar>& matrix) {
    auto pose = examine(matrix, false);
    if (!pose.ok() || health_.flags.has_any({PoseFlag::no_sensor, PoseFlag::wrong_handedness})) {
        return false;
    }
    StartPose<Scalar> chosen = *pose;
    resolve_hemisphere(chosen, matrix);
    start_state<Scalar>(state_, model_, chosen, raw_, params_);
    counters_.acquisitions += mode_ == TrackerState::tracking ? 0U : 1U;
    mode_ = TrackerState::tracking;
    last_used_ = state_.time;
    record_.start(state_.time);
    accepted_.clear();
    reset_adaptation();
    return true;
}

/// The pose of a matrix, sought beside the present state or from nothing; flags, distortion and signal to noise go to health_.
template <typename Scalar, MeasurementModel<Scalar> Model>
[[gnu::noinline]] Result<StartPose<Scalar>> Filter<Scalar, Model>::examine(const SignalMatrix<Scalar>& matrix, bool beside) {
    const auto pose = beside ? model_.near(matrix.x, state_.position_m, state_.q_source_sensor) : model_.start(matrix.x);
    health_ = Health{};
    health_.x = matrix.x;
    if (!pose.ok()) {
        health_.flags.set(PoseFlag::no_sensor);
        return pose;
    }
    const Scalar bend = beside ? pose->strength * signal_curvature(state_) : Scalar(0);
    const Scalar remainder = bend * deskew_remainder_s2(seconds_as<Scalar>(params_.max_column_span));
    const Scalar blur = bend * blur_s2(params_.window_s);
    blur_variance_ = blur * blur;
    const Scalar variance = matrix.sigma * matrix.sigma + remainder * remainder + blur_variance_;
    const Scalar snr = pose->strength / matrix.sigma;
    health_.distortion_chi_square = pose->misfit_squared / variance;
    health_.snr_db = 20 * std::log10(snr);
    const bool significant = health_.distortion_chi_square > params_.distortion_gate;
    health_.flags.set_if(!pose->right_handed, PoseFlag::wrong_handedness);
    health_.flags.set_if(snr < params_.min_snr, PoseFlag::low_signal);
    health_.flags.set_if(significant, PoseFlag::distorted);
    health_.flags.set_if(significant && pose->misfit_squared > params_.max_misfit * matrix.x.squaredNorm(), PoseFlag::no_sensor);
    return pose;
}

/// The sign of the position: from the model where it knows, otherwise told or continued.
template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::resolve_hemisphere(StartPose<Scalar>& pose, const SignalMatrix<Scalar>& matrix) {
    if (pose.hemisphere_from_data) {
        hemisphere_.resolved_by_data();
        return;
    }
    if (!hemisphere_.must_turn(pose.position_m, matrix.newest)) {
        return;
    }
    pose.position_m = -pose.position_m;
    if constexpr (!Model::kEven) {  // beside the mirror image, not at it
        const auto turned = model_.near(matrix.x, pose.position_m, geometry::attitude_quaternion(pose.attitude));
        pose = turned.ok() ? *turned : pose;
    }
}

template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::reset_adaptation() {
    process_ = {std::log(params_.process.start_m2_s3),
                std::log(params_.process.start_rad2_s3),
                Scalar(1),
                Scalar(1),
                Scalar(0),
                Scalar(0)};
    consistency_ = 1;
    surprise_ = 0;
    noise_.restart();
    settled_ = kSourceCoils;
    flags_of_state_.fill({});
    since_health_ = 0;
    pending_ = 0;
    blur_variance_ = 0;
}

/// Tracking -> lost at once; lost -> searching after search_after.
template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::lose(DeviceTime time) {
    if (mode_ == TrackerState::tracking) {
        mode_ = TrackerState::lost;
        accepted_.clear();
    }
    if (mode_ == TrackerState::lost && time - last_used_ > params_.search_after) {
        mode_ = TrackerState::searching;
    }
}

/// Always one; as an option, so that all who hand it on do so in place.
template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<PoseEstimate<Scalar>> Filter<Scalar, Model>::report(PoseFlags flags, Microseconds ahead) {
    const bool moved = ahead.count() > 0;
    const State<Scalar> later = moved ? moved_on(ahead) : State<Scalar>{};
    const State<Scalar>& state = moved ? later : state_;
    std::optional<PoseEstimate<Scalar>> reported(std::in_place);
    PoseEstimate<Scalar>& estimate = *reported;
    estimate.sensor = sensor_;
    estimate.sequence = static_cast<std::uint32_t>(counters_.poses++);
    estimate.time = state.time;
    estimate.state = mode_;
    estimate.position_m = state.position_m;
    estimate.q_source_sensor = state.q_source_sensor;
    // A window of innovations larger than predicted: some assumption is wrong; say so in the covariance before the flag does.
    estimate.covariance = state.covariance.template topLeftCorner<6, 6>() *
                          (Scalar(kMargin) * std::max({noise_.excess(), consistency_, surprise_}));
    estimate.flags = flags | health_.flags;
    estimate.flags.set_if(!hemisphere_.known(), PoseFlag::hemisphere_unknown);
    estimate.flags.set_if(!record_.confirmed(), PoseFlag::unconfirmed);
    estimate.flags.set_if(ahead > params_.coast_limit, PoseFlag::coasting);
    estimate.flags.set_if(settled_ < kSettlingColumns, PoseFlag::not_converged);
    estimate.flags.set_if(std::max(consistency_, noise_.excess()) > params_.inconsistent_above, PoseFlag::inconsistent);
    estimate.flags.set_if(mode_ != TrackerState::tracking || record_.silence(state_.time) > params_.coast_limit, PoseFlag::stale);
    estimate.distortion_chi_square = health_.distortion_chi_square;
    estimate.snr_db = health_.snr_db;
    estimate.signal_matrix = health_.x;
    counters_.invalid_poses += estimate.valid() ? 0U : 1U;
    if (estimate.valid()) {
        estimate.predicted_error = expected_error(state, estimate.covariance);
        cover_blur(estimate);
    }
    if (!estimate.flags.has_any(kDiscontinuous)) {
        hemisphere_.follow(state_.position_m, state_.time);
    }
    return reported;
}

/// Blur is no noise: it stays the same from column to column and no averaging takes it away, so its size goes into the covariance
/// as it is, whatever its direction.
template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::cover_blur(PoseEstimate<Scalar>& estimate) const {
    const Scalar position_m = estimate.predicted_error->blur.position_mm / 1000;
    const Scalar rotation_rad = estimate.predicted_error->blur.orientation_deg * (std::numbers::pi_v<Scalar> / 180);
    estimate.covariance.diagonal().template head<3>().array() += position_m * position_m / 3;
    estimate.covariance.diagonal().template tail<3>().array() += rotation_rad * rotation_rad / 3;
}

/// Of the error model's terms a filter keeps the window's blur, the latency, and its own covariance in place of the noise.
template <typename Scalar, MeasurementModel<Scalar> Model>
error_model::ErrorBudget<Scalar> Filter<Scalar, Model>::expected_error(const State<Scalar>& state,
                                                                       const Mat6<Scalar>& covariance) const {
    error_model::BoardTiming<Scalar> timing;
    timing.window_s = params_.window_s;
    timing.latency_s = params_.latency_s;
    const error_model::MotionState<Scalar> motion{state.position_m, state.q_source_sensor,   state.velocity_m_s,
                                                  state.rate_rad_s, state.acceleration_m_s2, state.angular_acceleration_rad_s2};
    return error_model::budget_of(error_model::timing_errors(motion, timing), covariance);
}

template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<PoseEstimate<Scalar>> Filter<Scalar, Model>::tick(DeviceTime now) {
    if (counters_.acquisitions == 0 || now > TimeBase::kLatest || now < TimeBase::kEarliest) {
        return std::nullopt;
    }
    if (now <= last_used_) {
        if (last_used_ - now <= params_.lost_after) {
            return std::nullopt;
        }
        return report({PoseFlag::stale}, Microseconds{0});
    }
    if (mode_ == TrackerState::tracking) {
        use_pending();
    }
    const Microseconds age = record_.silence(now);
    if (mode_ != TrackerState::tracking || age > params_.lost_after) {
        lose(now);
        return report({PoseFlag::stale}, Microseconds{0});
    }
    const Microseconds ahead = now > state_.time ? now - state_.time : Microseconds{0};
    PoseFlags flags{PoseFlag::coasting};
    flags.set_if(age > params_.coast_limit, PoseFlag::stale);
    return report(flags, ahead + params_.predict_ahead);
}

template <typename Scalar, MeasurementModel<Scalar> Model>
Status Filter<Scalar, Model>::set_hemisphere(const Vec3<Scalar>& towards) {
    if (!towards.allFinite()) {
        return {StatusCode::not_finite, "hemisphere must be a finite direction, or zero for unknown"};
    }
    hemisphere_.set(towards);
    if (state_.position_m.dot(towards) < 0) {
        if constexpr (Model::kEven) {
            mirror(state_);
        } else {  // where X is not even, the other side is another motion: sought anew
            lose(state_.time);
        }
    }
    return {};
}

template <typename Scalar, MeasurementModel<Scalar> Model>
State<Scalar> Filter<Scalar, Model>::predicted(Scalar ahead_s) const {
    constexpr Scalar kLongest_s = 10;
    const bool forward = ahead_s > 0;  // not for a NaN either
    const Scalar us = forward ? Scalar(1e6) * std::min(ahead_s, kLongest_s) : Scalar(0);
    return moved_on(Microseconds{static_cast<std::int32_t>(us + Scalar(0.5))});
}

template <typename Scalar, MeasurementModel<Scalar> Model>
State<Scalar> Filter<Scalar, Model>::moved_on(Microseconds ahead) const {
    State<Scalar> state = state_;
    propagate(state, intensity(), state_.time + ahead);
    return state;
}

template <typename Scalar, MeasurementModel<Scalar> Model>
Intensity<Scalar> Filter<Scalar, Model>::intensity() const {
    return {std::exp(process_.log_translation), std::exp(process_.log_rotation)};
}

}  // namespace tricoil::tracking::scaat

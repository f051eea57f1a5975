// Definitions of Filter; include only where it is instantiated for a field model.
#pragma once

#include "core/geometry/angles.hpp"
#include "core/tracking/scaat/filter.hpp"

namespace tricoil::tracking::scaat {

/// Columns that say nothing about the couplings.
constexpr ColumnFlags kUnusable{ColumnFlag::no_reference, ColumnFlag::saturated, ColumnFlag::clipped, ColumnFlag::stuck,
                                ColumnFlag::overrun};

constexpr PoseFlags pose_flags(ColumnFlags column) {
    PoseFlags flags;
    flags.set_if(column.has_any({ColumnFlag::saturated, ColumnFlag::clipped}), PoseFlag::saturated);
    flags.set_if(column.has(ColumnFlag::no_reference), PoseFlag::no_reference);
    flags.set_if(column.has(ColumnFlag::low_signal), PoseFlag::low_signal);
    flags.set_if(column.has(ColumnFlag::stuck), PoseFlag::no_sensor);
    flags.set_if(column.has(ColumnFlag::overrun), PoseFlag::unconfirmed);
    return flags;
}

template <typename Scalar, MeasurementModel<Scalar> Model>
Filter<Scalar, Model>::Filter(const Params<Scalar>& params, const Model& model)
    : params_(params), model_(model), raw_(params.max_column_span), accepted_(params.max_column_span, true) {
    reset_adaptation();
}

template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<PoseEstimate<Scalar>> Filter<Scalar, Model>::update(const Column<Scalar>& column) {
    if (const auto reason = why_refused(column)) {
        ++counters_.rejected[static_cast<std::size_t>(*reason)];
        return std::nullopt;
    }
    ++counters_.accepted;
    sensor_ = column.sensor;
    const bool late = has_column_ && column.midpoint < newest_column_;
    remember(column);
    if (mode_ == TrackerState::tracking && !late && column.midpoint - last_used_ > params_.lost_after) {
        lose(column.midpoint);
    }
    if (mode_ != TrackerState::tracking) {
        lose(column.midpoint);
        return search(column);
    }
    return track(column);
}

template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<Rejection> Filter<Scalar, Model>::why_refused(const Column<Scalar>& column) const {
    if (coil_index(column.state) < 0) {
        return Rejection::unknown_state;
    }
    if (!column.in_phase.allFinite() || !column.quadrature.allFinite()) {
        return Rejection::not_finite;
    }
    if (!column.sigma.allFinite() || !(column.sigma.minCoeff() > 0)) {
        return Rejection::bad_sigma;
    }
    if (!has_column_ || column.midpoint > newest_column_) {
        return std::nullopt;
    }
    for (const Seen& seen : recent_) {
        if (seen.state == column.state && seen.midpoint == column.midpoint) {
            return Rejection::duplicate;
        }
    }
    const bool too_late = newest_column_ - column.midpoint > params_.max_lateness;
    const bool cannot_use = mode_ != TrackerState::tracking && column.midpoint < newest_column_;
    return too_late || cannot_use ? std::optional(Rejection::time_backwards) : std::nullopt;
}

template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::remember(const Column<Scalar>& column) {
    recent_[next_recent_] = {column.midpoint, column.state};
    next_recent_ = (next_recent_ + 1) % kRecent;
    newest_column_ = has_column_ ? std::max(newest_column_, column.midpoint) : column.midpoint;
    has_column_ = true;
}

/// Whether the newest instant has brought all three columns, usable or not.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::frame_complete() const {
    int simultaneous = 0;
    for (const Seen& seen : recent_) {
        simultaneous += seen.state != Excitation::off && seen.midpoint == newest_column_ ? 1 : 0;
    }
    return simultaneous == kSourceCoils;
}

/// One column while tracking.
template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<PoseEstimate<Scalar>> Filter<Scalar, Model>::track(const Column<Scalar>& column) {
    const int coil = coil_index(column.state);
    flags_of_state_[static_cast<std::size_t>(coil)] = pose_flags(column.flags);
    PoseFlags flags =
        flags_of_state_[0] | flags_of_state_[1] | flags_of_state_[2];  // a state that is not heard leaves directions open
    const bool in_order = column.midpoint >= state_.time;
    if (in_order) {
        propagate(state_, intensity(), column.midpoint);
    }
    const bool reports = !in_frames() || frame_complete();
    const auto raw = in_order && !column.flags.has_any(kUnusable) ? raw_.add(column) : std::nullopt;
    if (column.flags.has_any(kUnusable) || (in_frames() && in_order && !raw)) {
        return reports ? std::optional(report(flags, params_.predict_ahead)) : std::nullopt;
    }
    const bool accepted = in_frames() && in_order ? use_frame(*raw) : use(column, state_, contradicted_before(coil));
    if (left_behind(accepted, coil)) {
        ++counters_.reopened;
        if (!raw || !start(*raw)) {
            lose(column.midpoint);
            flags |= health_.flags;
        }
        flags.set(PoseFlag::unconfirmed);
        return report(flags, params_.predict_ahead);
    }
    if (accepted && in_order && !in_frames()) {
        const auto matrix = accepted_.add(column);
        const bool deskewed = settled_ >= 3 * kSourceCoils;  // two columns of each state since the start's three
        if (matrix && deskewed && ++since_health_ >= kSourceCoils) {
            since_health_ = 0;
            (void)examine(*matrix, true);  // what it finds stands in health_
        }
    }
    flags.set_if(!accepted || refused_in_row_ > 0, PoseFlag::unconfirmed);
    return reports ? std::optional(report(flags, params_.predict_ahead)) : std::nullopt;
}

/// Three simultaneous columns. Their direct pose is where the model is linearised: exact however far the prediction is off. Nine
/// numbers that agree on a pose are no outliers, so a prediction that they contradict is opened at once. False if most are
/// refused.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::use_frame(const SignalMatrix<Scalar>& matrix) {
    const auto pose = examine(matrix, true);
    State<Scalar> around = state_;
    const bool agree = pose.ok() && !health_.flags.has(PoseFlag::distorted);
    if (agree) {
        around.position_m = pose->position_m;
        around.q_source_sensor = geometry::attitude_quaternion(pose->attitude);
    }
    int refused = 0;
    for (int j = 0; j < kSourceCoils; ++j) {
        refused += use(raw_.latest(j), agree ? around : state_, agree) ? 0 : 1;
    }
    return 2 * refused < kSourceCoils;
}

/// Updates with a column if it passes the gate, linearised at `around`. One that does not pass is left out as an outlier, unless
/// `trusted`: then the sensor has accelerated beyond what was thought possible, and the prediction is opened until it passes.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::use(const Column<Scalar>& column, const State<Scalar>& around, bool trusted) {
    auto innovation = column_innovation<Scalar>(model_, state_, around, column);
    if (!innovation.ok) {
        return false;
    }
    const auto coil = static_cast<std::size_t>(coil_index(column.state));
    const bool far = innovation.y.norm() > params_.most_opened * column.in_phase.norm();
    const bool may_open = trusted && !far && !far_of_state_[0] && !far_of_state_[1] && !far_of_state_[2];
    for (int n = 0; may_open && innovation.ok && innovation.whitened().squaredNorm() > params_.gate && n < kMostOpenings; ++n) {
        open(innovation.whitened().squaredNorm() / 3);
        innovation = column_innovation<Scalar>(model_, state_, around, column);
    }
    const Vec3<Scalar> whitened = innovation.whitened();
    const Scalar nis = whitened.squaredNorm();
    if (!innovation.ok || !(nis <= params_.gate)) {
        far_of_state_[coil] = far;
        ++counters_.outliers;
        return false;
    }
    far_of_state_[coil] = false;
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

/// Whether the column before, or the last of this source coil, was refused: two that contradict the prediction are no outliers.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::contradicted_before(int coil) const {
    return refused_in_row_ > 0 || refused_of_state_[static_cast<std::size_t>(coil)] > 0;
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

/// Counts refusals in a row, of all columns and per state: a jump refuses all, a coil that changed only its own.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::left_behind(bool accepted, int coil) {
    int& of_state = refused_of_state_[static_cast<std::size_t>(coil)];
    refused_in_row_ = accepted ? 0 : refused_in_row_ + 1;
    of_state = accepted ? 0 : of_state + 1;
    return refused_in_row_ >= kMostRefused || of_state >= kMostRefused;
}

/// One column while searching or lost.
template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<PoseEstimate<Scalar>> Filter<Scalar, Model>::search(const Column<Scalar>& column) {
    const auto matrix = raw_.add(column);
    if (!matrix) {
        return std::nullopt;
    }
    PoseFlags flags = pose_flags(matrix->flags);
    if (matrix->flags.has_any(kUnusable) || !start(*matrix)) {
        PoseEstimate<Scalar> estimate = report(flags | health_.flags, Microseconds{0});
        estimate.flags.set(PoseFlag::stale);
        estimate.time = column.midpoint;
        return estimate;
    }
    return report(flags, params_.predict_ahead);
}

/// Begins to track from the three columns of `matrix`; false, with the reason in health_, if they are no pose.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::start(const SignalMatrix<Scalar>& matrix) {
    auto pose = examine(matrix, false);
    if (!pose.ok() || health_.flags.has_any({PoseFlag::no_sensor, PoseFlag::wrong_handedness})) {
        return false;
    }
    StartPose<Scalar> chosen = *pose;
    hemisphere_known_ = resolve_hemisphere(chosen);
    state_ = start_state<Scalar>(model_, chosen, raw_, params_);
    counters_.acquisitions += mode_ == TrackerState::tracking ? 0U : 1U;
    mode_ = TrackerState::tracking;
    has_last_ = true;
    last_used_ = state_.time;
    accepted_.clear();
    reset_adaptation();
    return true;
}

/// The pose of a matrix, sought beside the present state or from nothing; flags, distortion and signal to noise go to health_.
template <typename Scalar, MeasurementModel<Scalar> Model>
Result<StartPose<Scalar>> Filter<Scalar, Model>::examine(const SignalMatrix<Scalar>& matrix, bool beside) {
    const auto pose = beside ? model_.near(matrix.x, state_.position_m, state_.q_source_sensor) : model_.start(matrix.x);
    health_ = Health{};
    health_.x = matrix.x;
    if (!pose.ok()) {
        health_.flags.set(PoseFlag::no_sensor);
        return pose;
    }
    const Scalar remainder = beside ? pose->strength * deskew_remainder() : Scalar(0);
    const Scalar variance = matrix.sigma * matrix.sigma + remainder * remainder;
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

/// What deskewing leaves of a coupling in motion, over the coupling strength k: linear extrapolation by a share a of the frame T
/// errs by (a + a^2) T^2 X''/2, at most with a = 2/3. X'' from k / rho^3 and the turning of u and O; root mean square of the nine
/// entries of (6). Metal that does less cannot be told from motion.
template <typename Scalar, MeasurementModel<Scalar> Model>
Scalar Filter<Scalar, Model>::deskew_remainder() const {
    constexpr Scalar kShare = Scalar(2) / 3;
    constexpr Scalar kEntry = Scalar(0.41);                                            // sqrt(3/2) / 3
    const Scalar frame_s = Scalar(1.2) * seconds_as<Scalar>(params_.max_column_span);  // three slots; the span is 2.5
    const Scalar range = state_.position_m.norm();
    const Scalar v = state_.velocity_m_s.norm() / range;
    const Scalar w = state_.rate_rad_s.norm();
    const Scalar curvature =
        3 * state_.acceleration_m_s2.norm() / range + 12 * v * v + 6 * v * w + w * w + state_.angular_acceleration_rad_s2.norm();
    return kEntry * (kShare + kShare * kShare) / 2 * frame_s * frame_s * curvature;
}

/// The sign of the position: from the model where it knows, by continuity from a recent pose, by the setting. False: a guess.
template <typename Scalar, MeasurementModel<Scalar> Model>
bool Filter<Scalar, Model>::resolve_hemisphere(StartPose<Scalar>& pose) const {
    if (pose.hemisphere_from_data) {
        return true;
    }
    const Vec3<Scalar>& towards = has_last_ ? state_.position_m : params_.hemisphere;
    if (pose.position_m.dot(towards) < 0) {
        pose.position_m = -pose.position_m;
    }
    return has_last_ ? hemisphere_known_ : !params_.hemisphere.isZero();
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
    settled_ = kSourceCoils;
    flags_of_state_.fill({});
    refused_in_row_ = 0;
    refused_of_state_.fill(0);
    far_of_state_.fill(false);
    since_health_ = 0;
}

/// Tracking -> lost at once; lost -> searching, the last pose forgotten, after search_after.
template <typename Scalar, MeasurementModel<Scalar> Model>
void Filter<Scalar, Model>::lose(DeviceTime time) {
    if (mode_ == TrackerState::tracking) {
        mode_ = TrackerState::lost;
        accepted_.clear();
    }
    if (mode_ == TrackerState::lost && time - last_used_ > params_.search_after) {
        mode_ = TrackerState::searching;
        has_last_ = false;
    }
}

template <typename Scalar, MeasurementModel<Scalar> Model>
PoseEstimate<Scalar> Filter<Scalar, Model>::report(PoseFlags flags, Microseconds ahead) {
    const bool moved = ahead.count() > 0;
    const State<Scalar> later = moved ? predicted(seconds_as<Scalar>(ahead)) : State<Scalar>{};
    const State<Scalar>& state = moved ? later : state_;
    PoseEstimate<Scalar> estimate;
    estimate.sensor = sensor_;
    estimate.sequence = static_cast<std::uint32_t>(counters_.poses++);
    estimate.time = state.time;
    estimate.state = mode_;
    estimate.position_m = state.position_m;
    estimate.q_source_sensor = state.q_source_sensor;
    // A window of innovations larger than predicted: some assumption is wrong; say so in the covariance before the flag does.
    estimate.covariance = state.covariance.template topLeftCorner<6, 6>() * (Scalar(kMargin) * std::max(Scalar(1), consistency_));
    estimate.flags = flags | health_.flags;
    estimate.flags.set_if(!hemisphere_known_, PoseFlag::hemisphere_unknown);
    estimate.flags.set_if(settled_ < kSettlingColumns, PoseFlag::not_converged);
    estimate.flags.set_if(consistency_ > params_.inconsistent_above, PoseFlag::inconsistent);
    estimate.flags.set_if(mode_ != TrackerState::tracking || state_.time - last_used_ > params_.coast_limit, PoseFlag::stale);
    estimate.distortion_chi_square = health_.distortion_chi_square;
    estimate.snr_db = health_.snr_db;
    estimate.signal_matrix = health_.x;
    counters_.invalid_poses += estimate.valid() ? 0U : 1U;
    if (estimate.valid()) {
        estimate.predicted_error = expected_error(state, estimate.covariance);
    }
    return estimate;
}

/// Of the error model's terms a filter keeps the window's blur, the latency, and its own covariance in place of the noise.
template <typename Scalar, MeasurementModel<Scalar> Model>
error_model::ErrorBudget<Scalar> Filter<Scalar, Model>::expected_error(const State<Scalar>& state,
                                                                       const Mat6<Scalar>& covariance) const {
    error_model::BudgetParams<Scalar> budget;
    budget.timing.window_s = params_.window_s;
    budget.timing.latency_s = params_.latency_s;
    const error_model::MotionState<Scalar> motion{state.position_m, state.q_source_sensor,   state.velocity_m_s,
                                                  state.rate_rad_s, state.acceleration_m_s2, state.angular_acceleration_rad_s2};
    return error_model::error_budget(motion, covariance, budget);
}

template <typename Scalar, MeasurementModel<Scalar> Model>
std::optional<PoseEstimate<Scalar>> Filter<Scalar, Model>::tick(DeviceTime now) {
    if (counters_.acquisitions == 0 || now <= last_used_) {
        return std::nullopt;
    }
    const Microseconds age = now - last_used_;
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
    params_.hemisphere = towards;
    hemisphere_known_ = !towards.isZero();
    if (has_last_ && state_.position_m.dot(towards) < 0) {
        // X is the same at -p, and at -p moving with -v; only the rotation block keeps its sign.
        state_.position_m = -state_.position_m;
        state_.velocity_m_s = -state_.velocity_m_s;
        Vec12<Scalar> sign = Vec12<Scalar>::Ones();
        sign.template segment<3>(0).setConstant(-1);
        sign.template segment<3>(6).setConstant(-1);
        state_.covariance = sign.asDiagonal() * state_.covariance * sign.asDiagonal();
    }
    return {};
}

template <typename Scalar, MeasurementModel<Scalar> Model>
State<Scalar> Filter<Scalar, Model>::predicted(Scalar ahead_s) const {
    State<Scalar> state = state_;
    propagate(state, intensity(), state_.time + microseconds_from_seconds(static_cast<double>(ahead_s)));
    return state;
}

template <typename Scalar, MeasurementModel<Scalar> Model>
Intensity<Scalar> Filter<Scalar, Model>::intensity() const {
    return {std::exp(process_.log_translation), std::exp(process_.log_rotation)};
}

}  // namespace tricoil::tracking::scaat

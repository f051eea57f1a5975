#include "core/tracking/coil/coil_tracker.hpp"

#include "core/base/precision.hpp"

namespace tricoil::tracking {

/// The gain of a single coil is constant, it has no rate about its axis, and the covariance turns with the axis.
template <typename Scalar>
void CoilTracker<Scalar>::advance_to(DeviceTime time) {
    const Scalar variance = gain_variance();
    scaat::propagate(state_, adaptation_.intensity(), time);
    if (!is_single()) {
        return;
    }
    set_gain_variance(variance);
    const Vec3<Scalar> now = axis();
    const Mat3<Scalar> v = geometry::skew(Vec3<Scalar>(aligned_.cross(now)));
    const Mat3<Scalar> turn = Mat3<Scalar>::Identity() + v + v * v / (1 + aligned_.dot(now));
    for (const auto& [block, m] : {std::pair{3, turn}, {9, Mat3<Scalar>(turn - now * aligned_.transpose())}}) {
        for (int i = 0; i < scaat::kErrorStates; i += 3) {
            const Mat3<Scalar> part = m * Mat3<Scalar>(state_.covariance.template block<3, 3>(block, i));
            state_.covariance.template block<3, 3>(i, block) = part.transpose();
            state_.covariance.template block<3, 3>(block, i) = i == block ? Mat3<Scalar>(part * m.transpose()) : part;
        }
    }
    aligned_ = now;
    state_.rate_rad_s -= now * now.dot(state_.rate_rad_s);
}

/// The couplings of a frame, and not a single one, which may be zero, tell the size of second-order terms.
template <typename Scalar>
scaat::Innovation<Scalar> CoilTracker<Scalar>::innovation_of(const Column& column) const {
    auto result = scaat::innovation<Scalar>(field_, state_, state_, static_cast<int>(column.source), column.in_phase, Scalar(0));
    const Scalar square = mean_square(&Column::in_phase);
    const Scalar couplings = Scalar(field_.coils.size());
    const Scalar misfit = params_.misfit[column.source];
    const Scalar more =
        scaat::second_order_variance(result, couplings * square) / couplings + misfit * misfit * square * Scalar(frame());
    const Vec3<Scalar> variance = column.sigma.cwiseAbs2() + Vec3<Scalar>::Constant(more);
    result.set_noise(scaat::resolvable_variance<Scalar>(variance, result));
    return result;
}

template <typename Scalar>
void CoilTracker<Scalar>::update_with(const scaat::Innovation<Scalar>& innovation) {
    const auto gains_per_s = scaat::acceleration_gains_per_s(state_.covariance);
    const auto correction = scaat::apply(state_, innovation);
    if (is_single()) {
        field_.coils[0].gain *= std::exp(aligned_.dot(correction.template segment<3>(3)));
    }
    if (settled_ >= 3 * frame()) {
        scaat::learn_acceleration(state_, correction, gains_per_s);
    }
}

/// Solves the first coil alone. motion_share: error of a coupling by motion between the columns, relative to all.
template <typename Scalar>
auto CoilTracker<Scalar>::solve(Scalar motion_share) const -> Solution {
    std::array<Scalar, field::kMaxGeneratorCoils> value{};
    std::array<Scalar, field::kMaxGeneratorCoils> weight{};
    const Scalar squares = mean_square(&Column::in_phase) * Scalar(frame());
    for (const auto& column : columns_) {
        const Scalar misfit = params_.misfit[column.source];
        value[column.source] = column.in_phase(0);
        weight[column.source] =
            1 / std::sqrt(column.sigma(0) * column.sigma(0) + squares * (misfit * misfit + motion_share * motion_share));
    }
    solver::SingleCoilParams<Scalar> params;
    params.gain = params_.field.coils[0].gain;
    params.gain_deviation = params_.gain_deviation;
    params.side = params_.side;
    return solver::solve_single_coil<Scalar>(field_.generator, {{value.data(), frame()}, {weight.data(), frame()}}, params);
}

/// The rotation about the axis is that of several which explains the couplings of the other coils best.
template <typename Scalar>
void CoilTracker<Scalar>::place(const solver::SingleCoilPose<Scalar>& pose) {
    const BodyCoil<Scalar>& coil = field_.coils[0];
    const Vec3<Scalar> axis = pose.sensitivity.normalized();
    Vec3<Scalar> half = coil.axis + axis;  // a half turn about it turns the one to the other
    if (half.squaredNorm() < Scalar(1e-4)) {
        half = coil.axis.cross(std::abs(axis.x()) < Scalar(0.5) ? Vec3<Scalar>::UnitX() : Vec3<Scalar>::UnitY());
    }
    half.normalize();
    const Quat<Scalar> first(0, half.x(), half.y(), half.z());
    Scalar least = std::numeric_limits<Scalar>::max();
    const int turns = is_single() ? 1 : 24;
    for (int n = 0; n < turns; ++n) {
        const Vec3<Scalar> turn = (2 * std::numbers::pi_v<Scalar> * Scalar(n) / Scalar(turns)) * axis;
        const Quat<Scalar> q = geometry::rotation_vector_to_quaternion<Scalar>(turn) * first;
        const Vec3<Scalar> position_m = pose.position_m - q * coil.offset_m;
        Scalar cost = 0;
        for (const auto& column : columns_) {
            const auto model = field_.column(position_m, geometry::attitude_matrix(q), static_cast<int>(column.source));
            cost += (model.column - column.in_phase).squaredNorm();
        }
        if (cost < least) {
            least = cost;
            state_.position_m = position_m;
            state_.q_source_sensor = q;
        }
    }
}

/// Starts from the columns of a frame. The direct pose of columns of a moving sensor is too far for one linear step: the updates
/// are repeated from the pose that they gave. The prior is wide, because the same columns gave its pose.
template <typename Scalar>
PoseFlags CoilTracker<Scalar>::start() {
    constexpr int kPasses = 4;
    constexpr Scalar kWide = 25;
    auto found = solve(0);
    for (const double share : {0.01, 0.04}) {
        found = found.ok() && found->end == solver::SingleCoilEnd::wrong_minimum ? solve(Scalar(share)) : found;
    }
    if (!found.ok() || !found->converged()) {
        return PoseFlags{!found.ok() || found->end == solver::SingleCoilEnd::wrong_minimum ? PoseFlag::no_sensor
                         : found->end == solver::SingleCoilEnd::ambiguous                  ? PoseFlag::hemisphere_unknown
                                                                                           : PoseFlag::not_converged};
    }
    adaptation_.restart(params_.motion.process);
    state_ = {};
    settled_ = 0;
    refusals_ = large_ = 0;
    const bool is_known = params_.field.coils[0].gain > 0;
    const Scalar deviation = is_known ? params_.gain_deviation : 5 * found->gain_deviation;
    const Scalar gain = is_known ? params_.field.coils[0].gain : found->pose.sensitivity.norm();
    field_.coils[0].gain = gain;
    place(found->pose);
    const Scalar p = kWide * found->covariance.template topLeftCorner<3, 3>().trace();
    const Scalar r = kWide * found->covariance.template bottomRightCorner<3, 3>().trace() + Scalar(is_single() ? 0 : 0.1);
    const Scalar v = params_.motion.start_speed_m_s * params_.motion.start_speed_m_s;
    const Scalar w = params_.motion.start_rate_rad_s * params_.motion.start_rate_rad_s;
    for (int pass = 0; pass < kPasses; ++pass) {
        if (pass > 0) {
            scaat::move(state_, seconds_as<Scalar>(columns_[0].midpoint - state_.time));
        }
        state_.time = columns_[0].midpoint;
        state_.covariance = scaat::Vec12<Scalar>(p, p, p, r, r, r, v, v, v, w, w, w).asDiagonal();
        aligned_ = axis();
        if (is_single()) {
            set_gain_variance(deviation * deviation);
            field_.coils[0].gain = is_known ? gain : field_.coils[0].gain;
        }
        for (const auto& column : columns_) {
            advance_to(column.midpoint);
            if (const auto innovation = innovation_of(column); innovation.ok) {
                update_with(innovation);
            }
        }
    }
    settled_ = frame();
    awaited_ = 2 * losses_ * frame();
    last_used_ = state_.time;
    is_running_ = true;
    ++counters_.acquisitions;
    return {};
}

/// Updates with a column if it passes the gate, or if several of the last ones contradict too: then the sensor has accelerated.
template <typename Scalar>
bool CoilTracker<Scalar>::use(const Column& column) {
    const auto& motion = params_.motion;
    const std::size_t couplings = field_.coils.size();
    const Scalar gate = motion.gate * (Scalar(0.73) + Scalar(0.09) * Scalar(couplings));  // exceeded once in 7e5
    auto innovation = innovation_of(column);
    Vec3<Scalar> whitened = innovation.whitened();
    const Scalar far = motion.most_inflated * motion.most_inflated * mean_square(&Column::in_phase);
    const bool moves = count_in_frame(large_) > 2;  // one may be an outlier
    const bool may_inflate = moves && innovation.y.squaredNorm() <= far * Scalar(couplings);
    large_ = large_ << 1U | (scaat::excess_of(whitened.squaredNorm(), couplings) > 1 ? 1U : 0U);
    for (int n = 0; may_inflate && innovation.ok && whitened.squaredNorm() > gate && n < scaat::kMaxInflations; ++n) {
        const Scalar factor = whitened.squaredNorm() / Scalar(couplings);
        const Scalar variance = gain_variance();
        state_.covariance *= factor;
        if (is_single()) {
            set_gain_variance(variance);
        }
        adaptation_.inflate(factor);
        awaited_ = 2 * frame();
        innovation = innovation_of(column);
        whitened = innovation.whitened();
    }
    const bool is_used = innovation.ok && whitened.squaredNorm() <= gate;
    refusals_ = refusals_ << 1U | (is_used ? 0U : 1U);
    if (!is_used) {
        ++counters_.outliers;
        return false;
    }
    if (!moves) {
        scaat::reduce_weight(innovation, scaat::excess_of(whitened.squaredNorm(), couplings));
    }
    adaptation_.add(motion, state_, innovation, whitened, false, settled_ >= 2 * frame(), couplings);
    update_with(innovation);
    settled_ = std::min(settled_ + 1, 3 * frame());
    losses_ -= awaited_ == 1 ? losses_ / 2 : 0;
    awaited_ -= awaited_ > 0 ? 1 : 0;
    last_used_ = column.midpoint;
    return true;
}

template <typename Scalar>
std::optional<PoseEstimate<Scalar>> CoilTracker<Scalar>::update(const Column& column) {
    constexpr std::int64_t kLostFrames = 4;
    constexpr std::size_t kMostLosses = 8;
    const bool is_late = !columns_.empty() && column.midpoint < columns_[columns_.size() - 1].midpoint;
    if (column.source >= frame() || !(column.in_phase + column.sigma).allFinite() || column.sigma.minCoeff() < 0 || is_late) {
        return std::nullopt;
    }
    if (columns_.size() == frame()) {
        std::copy(columns_.begin() + 1, columns_.end(), columns_.begin());
        columns_[frame() - 1] = column;
    } else {
        (void)columns_.push_back(column);
    }
    is_running_ = is_running_ && column.midpoint - last_used_ <= kLostFrames * params_.frame;
    PoseFlags flags;
    if (is_running_) {
        advance_to(column.midpoint);
        if (!use(column) && ((refusals_ & 7U) == 7U || !scaat::is_possible(state_))) {
            ++counters_.reacquisitions;
            is_running_ = false;
            losses_ = std::min(losses_ + 1, kMostLosses);
            flags.set(PoseFlag::unconfirmed);
        }
    } else {
        std::uint32_t coils = 0;
        for (const auto& one : columns_) {
            coils |= 1U << one.source;
        }
        if (count_in_frame(coils) < static_cast<int>(frame()) || column.midpoint - columns_[0].midpoint > 2 * params_.frame) {
            return std::nullopt;
        }
        flags = start();
    }
    auto pose = report(flags, column.midpoint);
    if (!is_running_) {
        columns_ = {};
    }
    return pose;
}

/// Couplings of another generator, or in another order, fit only a sensor that changes its velocity in every frame: then the
/// deviation is larger than the noise and the estimated motion in a frame explain. The shares are from simulations of a needle
/// with 20 to 80 dB at up to 1.5 m/s, and of each two exchanged coils.
template <typename Scalar>
Scalar CoilTracker<Scalar>::explained_deviation_m(Scalar snr) const {
    Scalar nearest_m = std::numeric_limits<Scalar>::max();
    Scalar misfit = 0;
    for (std::size_t n = 0; n < frame(); ++n) {
        nearest_m = std::min(nearest_m, (state_.position_m - field_.generator[n].position_m).norm());
        misfit = std::max(misfit, params_.misfit[n]);
    }
    const Scalar noise = std::sqrt(1 / (snr * snr) + misfit * misfit * Scalar(frame()));
    const Scalar frame_s = seconds_as<Scalar>(params_.frame);
    return nearest_m * (noise + Scalar(0.004)) +
           frame_s * (Scalar(0.3) * state_.velocity_m_s.norm() + Scalar(0.1) * nearest_m * state_.rate_rad_s.norm());
}

template <typename Scalar>
PoseEstimate<Scalar> CoilTracker<Scalar>::report(PoseFlags flags, DeviceTime now) {
    PoseEstimate<Scalar> pose;
    pose.sequence = static_cast<std::uint32_t>(counters_.poses++);
    pose.time = now;
    pose.flags = flags;
    const Scalar snr = std::sqrt(mean_square(&Column::in_phase) / mean_square(&Column::sigma));
    pose.snr_db = 20 * std::log10(snr);
    pose.flags.set_if(snr < params_.min_snr, PoseFlag::low_signal);
    if (!is_running_) {
        clear_position(pose);
        return pose;
    }
    pose.state = TrackerState::tracking;
    pose.position_m = state_.position_m;
    pose.q_source_sensor = state_.q_source_sensor;
    pose.covariance =
        state_.covariance.template topLeftCorner<6, 6>() * (Scalar(scaat::kCovarianceMargin) * adaptation_.covariance_factor());
    if (is_single()) {
        constexpr Scalar kUnknown = std::numbers::pi_v<Scalar> * std::numbers::pi_v<Scalar> / 3;  // variance of any angle
        const Vec3<Scalar> n = axis();
        Mat6<Scalar> across = Mat6<Scalar>::Identity();
        across.template bottomRightCorner<3, 3>() -= n * n.transpose();
        pose.covariance = across * pose.covariance * across.transpose();
        pose.covariance.template bottomRightCorner<3, 3>() += kUnknown * n * n.transpose();
    }
    awaited_ = deviation_m(pose) > explained_deviation_m(snr) ? std::max(awaited_, 2 * frame()) : awaited_;
    pose.flags.set_if(is_single(), PoseFlag::roll_undefined);
    pose.flags.set_if(awaited_ > 0 || count_in_frame(refusals_) > 1 || (refusals_ & 1U) != 0, PoseFlag::unconfirmed);
    pose.flags.set_if(settled_ < 2 * frame(), PoseFlag::not_converged);
    pose.flags.set_if(adaptation_.consistency() > params_.motion.inconsistent_above, PoseFlag::inconsistent);
    pose.flags.set_if(deviation_m(pose) > params_.max_deviation_m, PoseFlag::uncertain);
    return pose;
}

#if TRICOIL_SCALARS & 1  // float
template class CoilTracker<float>;
#endif
#if TRICOIL_SCALARS & 2  // double
template class CoilTracker<double>;
#endif

}  // namespace tricoil::tracking

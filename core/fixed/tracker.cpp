#include "core/fixed/tracker.hpp"

#include <algorithm>

#include "core/fixed/model_fit.hpp"
#include "core/tracking/judge/signal_flags.hpp"

namespace tricoil::fixed {
namespace {

using tracking::PoseFlag;

constexpr Status kUnexplained{StatusCode::not_converged, "the step from the last pose does not explain the couplings"};

/// Limit of times, so that differences of times and their sums with a block's length fit into 64 bits.
bool is_time(DeviceTime time) {
    constexpr std::int64_t kMax_us = std::int64_t{1} << 61;
    return to_us(time) > -kMax_us && to_us(time) < kMax_us;
}

Vec3<Metres> in_metres(const Vec3<Unit>& direction) {
    return direction.unaryExpr([](Unit entry) { return Metres::from(entry); });
}

Vec3<Metres> position_m(const VectorPose& pose) {
    return pose.direction.unaryExpr([&](Unit entry) { return product<28>(pose.range_m, entry); });
}

}  // namespace

Status check(const TrackerParams& params) {
    if (params.coupling_constant.mantissa < 1 << 30) {
        return {StatusCode::invalid_argument, "coupling constant must be positive and normalised"};
    }
    if (params.passes < 1 || params.passes > kMaxPasses) {
        return {StatusCode::invalid_argument, "passes must be 1 to 10"};
    }
    if (params.min_snr < 1 || params.max_misfit.raw() <= 0 || params.distortion_gate.raw() <= 0) {
        return {StatusCode::invalid_argument, "signal limits must be positive"};
    }
    if (params.lost_after.count() <= 0 || params.search_after < params.lost_after) {
        return {StatusCode::invalid_argument, "times must be positive, and search_after not shorter than lost_after"};
    }
    return {};
}

Tracker::Tracker(const Acquisition& acquisition, const DemodulatorParams& demodulator, const TrackerParams& params)
    : params_(params),
      demodulator_(acquisition, demodulator),
      max_column_span_(acquisition.column_span()),
      hemisphere_(in_metres(params.hemisphere), params.confined) {}

void Tracker::set_hemisphere(const Vec3<Unit>& towards) {
    hemisphere_.set(in_metres(towards));
    if (dot<29>(last_.direction, towards).raw() < 0) {
        last_.direction = -last_.direction;
    }
}

std::optional<PoseEstimate> Tracker::update(const SampleBlock& block) {
    if (is_out_of_order(block)) {
        return std::nullopt;
    }
    const auto columns = demodulator_.demodulate(block);
    if (!columns.ok()) {
        refuse(demodulator_.fits_length(block) ? Rejection::unknown_state : Rejection::wrong_length);
        return std::nullopt;
    }
    out_of_order_ = 0;
    const std::uint32_t lost = has_block_ ? block.sequence - last_sequence_ - 1 : 0U;
    counters_.lost_blocks += lost;
    since_gap_.add(static_cast<int>(columns->size()), lost > 0);
    ++counters_.accepted;
    has_block_ = true;
    last_sequence_ = block.sequence;
    last_start_ = block.start;
    for (const Column& column : *columns) {
        columns_[static_cast<std::size_t>(coil_index(column.state))] = column;
    }
    const auto measurement = assemble_columns();
    if (!measurement) {
        return std::nullopt;
    }
    PoseEstimate estimate = solve(*measurement);
    estimate.sensor = block.sensor;
    estimate.flags.set_if(since_gap_.is_recent(), PoseFlag::columns_missing);
    count(estimate, estimate.time);
    if (estimate.valid()) {
        last_estimate_ = estimate;
    }
    return estimate;
}

std::optional<PoseEstimate> Tracker::tick(DeviceTime now) {
    if (counters_.acquisitions == 0 || !is_time(now) || !state_.is_older(params_.lost_after, now)) {
        return std::nullopt;
    }
    PoseEstimate estimate = last_estimate_;
    estimate.flags.set(PoseFlag::stale);
    count(estimate, now);
    return estimate;
}

bool Tracker::refuse(Rejection reason) {
    since_gap_.refuse();
    ++counters_.rejected[static_cast<std::size_t>(reason)];
    return true;
}

bool Tracker::is_out_of_order(const SampleBlock& block) {
    if (!is_time(block.start)) {
        return refuse(Rejection::bad_time);
    }
    const bool repeated = has_block_ && static_cast<std::int32_t>(block.sequence - last_sequence_) <= 0;
    const bool backwards = has_block_ && block.start <= last_start_;
    if (!repeated && !backwards) {
        return false;
    }
    if (++out_of_order_ <= kMaxOutOfOrder) {
        return refuse(backwards ? Rejection::time_backwards : Rejection::repeated_sequence);
    }
    restart_tracking(block.start);
    return false;
}

/// Starts again after a restart of the device clock, which makes the stored times invalid. The last pose gets the time `now`.
void Tracker::restart_tracking(DeviceTime now) {
    ++counters_.restarts;
    columns_ = {};
    state_.restart(now);
    has_block_ = false;
    solved_at_.reset();
    hemisphere_.forget();
    out_of_order_ = 0;
}

std::optional<Tracker::Measurement> Tracker::assemble_columns() const {
    Measurement measurement{assemble({columns_[0].couplings, columns_[1].couplings, columns_[2].couplings}), {}, {}, {}};
    DeviceTime oldest = columns_[0].midpoint;
    measurement.newest = oldest;
    for (const Column& column : columns_) {
        if (column.state == Excitation::off) {
            return std::nullopt;
        }
        oldest = std::min(oldest, column.midpoint);
        measurement.newest = std::max(measurement.newest, column.midpoint);
        measurement.flags |= column.flags;
        measurement.variance = add(measurement.variance, column.variance);
    }
    if (measurement.newest - oldest > max_column_span_) {
        return std::nullopt;
    }
    measurement.variance = divide(measurement.variance, normalise(kSourceCoils, 0));
    return measurement;
}

PoseEstimate Tracker::solve(const Measurement& measurement) {
    PoseEstimate estimate;
    estimate.time = measurement.newest;
    estimate.flags = tracking::signal_flags(measurement.flags);
    Result<VectorPose> solved = follow(measurement);
    if (solved.ok()) {
        hemisphere_.step_to(position_m(*solved), measurement.newest);
    } else {
        solved = acquire(measurement);
    }
    if (!solved.ok()) {
        estimate.flags.set(solved.status().code() == StatusCode::degenerate ? PoseFlag::no_sensor : PoseFlag::not_converged);
        return estimate;
    }
    fill_estimate(measurement, *solved, estimate);
    const bool alone = !solved_at_ || estimate.time - *solved_at_ > params_.lost_after;
    if (!estimate.flags.has_any(tracking::kFaultFlags)) {
        solved_at_ = estimate.time;
    }
    estimate.flags.set_if(alone, PoseFlag::unconfirmed);
    estimate.q_source_sensor = last_attitude_ = with_sign_of(estimate.q_source_sensor, last_attitude_);
    if (estimate.valid()) {
        last_ = *solved;
        hemisphere_.follow(estimate.position_m, estimate.time);
    }
    estimate.flags.set_if(!hemisphere_.known(), PoseFlag::hemisphere_unknown);
    return estimate;
}

/// Previous-measurement step from the last pose. Also not_converged if the misfit of the result is too large for a sensor.
Result<VectorPose> Tracker::follow(const Measurement& measurement) const {
    if (params_.method == Method::direct || state() != tracking::TrackerState::tracking) {
        return Status{StatusCode::not_ready, "no previous pose"};
    }
    const auto stepped = step_vectors(measurement.x, params_.coupling_constant, last_, params_.passes);
    if (!stepped.ok()) {
        return stepped.status();
    }
    const ModelFit fit = fit_of(normalise(measurement.x), params_.coupling_constant, *stepped);
    return fit.misfit_share > params_.max_misfit ? Result<VectorPose>(kUnexplained) : stepped;
}

/// Direct solution, in the hemisphere from continuity or setting.
Result<VectorPose> Tracker::acquire(const Measurement& measurement) {
    const auto direct = solve_direct(measurement.x, params_.coupling_constant);
    if (!direct.ok()) {
        return direct.status();
    }
    VectorPose pose{direct->range_m, direct->direction, direct->attitude};
    if (hemisphere_.must_mirror(position_m(pose), measurement.newest)) {
        pose.direction = -pose.direction;
    }
    return pose;
}

/// Fills in the pose and its diagnostics, and adds the flags that depend on it.
void Tracker::fill_estimate(const Measurement& measurement, const VectorPose& pose, PoseEstimate& estimate) const {
    const ModelFit fit = fit_of(normalise(measurement.x), params_.coupling_constant, pose);
    estimate.position_m = position_m(pose);
    estimate.q_source_sensor = attitude_quaternion(pose.attitude);
    estimate.misfit_share = fit.misfit_share;
    const Scaled noise_squared = divide(measurement.variance, multiply(fit.strength, fit.strength));
    estimate.noise_share = to_fixed<31>(square_root(noise_squared));
    const std::int64_t least_snr = params_.min_snr;
    const Scaled snr_squared = multiply(normalise(least_snr * least_snr, 0), noise_squared);
    const bool significant =
        is_less(multiply(normalise(params_.distortion_gate.raw(), -16), measurement.variance), fit.misfit_squared);
    estimate.flags.set_if(!fit.right_handed, PoseFlag::wrong_handedness);
    estimate.flags.set_if(is_less(normalise(1, 0), snr_squared), PoseFlag::low_signal);
    estimate.flags.set_if(significant, PoseFlag::distorted);
    estimate.flags.set_if(significant && fit.misfit_share > params_.max_misfit, PoseFlag::no_sensor);
}

void Tracker::count(PoseEstimate& estimate, DeviceTime now) {
    if (estimate.valid()) {
        counters_.acquisitions += state_.found(now, params_) ? 1U : 0U;
    } else {
        ++counters_.invalid_poses;
        state_.missed(now, params_);
    }
    estimate.state = state();
    estimate.sequence = counters_.poses++;
}

}  // namespace tricoil::fixed

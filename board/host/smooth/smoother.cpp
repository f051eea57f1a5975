#include "board/host/smooth/smoother.hpp"

#include "core/geometry/quaternion_sign.hpp"
#include "core/linear/cholesky.hpp"
#include "core/tracking/scaat/column_update.hpp"

namespace tricoil::host {
namespace {

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
Vec3<double> in_source_frame(const Vec3<double>& vector, const tracking::AnyTracker& tracker) {
    tracking::PoseEstimate<double> end;
    tracking::PoseEstimate<double> begin;
    end.position_m = vector;
    tracker.to_source_frame(end);
    tracker.to_source_frame(begin);
    return end.position_m - begin.position_m;
}

}  // namespace

void Smoother::add(const tracking::PoseEstimate<double>& estimate, const tracking::AnyTracker& tracker) {
    Step step{estimate, *tracker.filter_state()};
    step.begins = begins_interval(step);
    steps_.push_back(step);
    if (steps_.size() == kPiece + kFollowing) {
        smooth_first(kPiece, tracker);
    }
}

void Smoother::finish(const tracking::AnyTracker& tracker) { smooth_first(steps_.size(), tracker); }

bool Smoother::begins_interval(const Step& step) const {
    if (steps_.empty() || step.filter.run == 0) {
        return true;
    }
    const Step& last = steps_.back();
    return last.filter.run != step.filter.run || last.filter.inflations != step.filter.inflations ||
           step.filtered.time < last.filtered.time;
}

SmoothedPose Smoother::reported(const Step& step, const tracking::scaat::State<double>& smoothed,
                                const tracking::AnyTracker& tracker) {
    tracking::PoseEstimate<double> own = step.filtered;  // with the part of the covariance that smoothing reduces
    own.covariance = step.filter.covariance;
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
    tracking::clear_unknown_position(pose);
    result.velocity_m_s = in_source_frame(smoothed.velocity_m_s, tracker);
    result.rate_rad_s = in_source_frame(smoothed.rate_rad_s, tracker);
    result.rate_covariance = kCovarianceShare * smoothed.covariance.bottomRightCorner<6, 6>();
    return result;
}

/// Smooths all steps, delivers the first `count` and forgets them.
void Smoother::smooth_first(std::size_t count, const tracking::AnyTracker& tracker) {
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

}  // namespace tricoil::host

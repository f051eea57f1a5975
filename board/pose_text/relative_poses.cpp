#include "board/pose_text/relative_poses.hpp"

#include <algorithm>

#include "core/geometry/quaternion_sign.hpp"
#include "core/tracking/relative_pose.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kHistory = 16;       // poses of the reference
constexpr std::size_t kMostWaiting = 256;  // reached only if the times of the poses make no sense

}  // namespace

void RelativePoses::take(const Pose& estimate) {
    if (estimate.sensor == reference_) {
        remember(estimate);
        release(estimate.time);
        give(tracking::relative_pose(estimate, estimate));
        return;
    }
    waiting_.push_back(estimate);
    release(estimate.time);
}

void RelativePoses::finish() {
    while (!waiting_.empty()) {
        give_oldest();
    }
    history_.clear();
    last_ = {};
}

void RelativePoses::remember(const Pose& pose) {
    if (!history_.empty() && pose.time < history_.back().time) {
        history_.clear();  // the clock of the device began again
    }
    history_.push_back(pose);
    if (history_.size() > kHistory) {
        history_.pop_front();
    }
}

/// Delivers waiting poses, up to the first that must wait longer: the reference is older, and the patience is not exhausted at
/// `now`.
void RelativePoses::release(DeviceTime now) {
    while (!waiting_.empty()) {
        const DeviceTime time = waiting_.front().time;
        const bool is_reached = !history_.empty() && time <= history_.back().time;
        const bool waits_too_long = now - time > kPatience || time - now > kPatience || waiting_.size() > kMostWaiting;
        if (!is_reached && !waits_too_long) {
            return;
        }
        give_oldest();
    }
}

void RelativePoses::give_oldest() {
    give(finished(waiting_.front()));
    waiting_.pop_front();
}

RelativePoses::Pose RelativePoses::finished(const Pose& pose) const {
    if (const auto reference = reference_at(pose.time)) {
        return tracking::relative_pose(pose, *reference);
    }
    Pose stale = pose;
    if (history_.empty()) {
        tracking::clear_position(stale);
        stale.q_source_sensor.setIdentity();
        stale.predicted_error.reset();
    } else {
        stale = tracking::relative_pose(pose, history_.back());
    }
    stale.flags.set(tracking::PoseFlag::stale);
    return stale;
}

std::optional<RelativePoses::Pose> RelativePoses::reference_at(DeviceTime time) const {
    const auto after = std::find_if(history_.begin(), history_.end(), [&](const Pose& pose) { return pose.time >= time; });
    if (after == history_.end()) {
        return std::nullopt;
    }
    if (after->time == time) {
        return *after;
    }
    if (after == history_.begin() || after->time - (after - 1)->time > kLongestGap) {
        return std::nullopt;
    }
    return tracking::interpolated_pose(*(after - 1), *after, time);
}

void RelativePoses::give(Pose pose) {
    if (pose.sensor < last_.size()) {
        auto& last = last_[pose.sensor];
        if (last) {
            pose.q_source_sensor = geometry::with_sign_of(pose.q_source_sensor, *last);
        }
        last = pose.q_source_sensor;
    }
    sink_(pose);
}

}  // namespace tricoil::host

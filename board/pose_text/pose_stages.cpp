#include "board/pose_text/pose_stages.hpp"

#include <utility>

namespace tricoil::host {

PoseStages::PoseStages(const OutputOptions& options, tracking::TrackerTap<double>& next)
    : next_(next),
      format_(make_output_format(options)),
      is_aligned_(!options.align_points.empty()),
      has_boresight_(options.boresight) {
    if (options.relative_to > 0) {
        relative_.emplace(static_cast<std::uint8_t>(options.relative_to - 1), [this](const Pose& pose) { pass(pose); });
    }
}

/// The boundary of a confined sensor goes through the source, so other frames do not have it.
void PoseStages::do_begin(const Settings& settings) {
    finish();
    Settings seen = settings;
    seen.tracker.common.confined = settings.tracker.common.confined && is_in_source_frame();
    next_.begin(seen);
}

void PoseStages::do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) {
    if (is_in_source_frame()) {
        next_.hemisphere(sensor, towards);
    }
}

/// A relative pose waits for its reference, and has no true pose.
void PoseStages::do_truth(std::uint8_t /*sensor*/, DeviceTime /*time*/, const TruePose& pose) {
    if (!relative_) {
        truth_ = pose;
    }
}

void PoseStages::do_pose(const Pose& estimate) { relative_ ? relative_->take(estimate) : pass(estimate); }

void PoseStages::finish() {
    if (relative_) {
        relative_->finish();
    }
}

void PoseStages::pass(const Pose& pose) {
    if (has_boresight_ && pose.valid() && pose.sensor < boresighted_.size() && !boresighted_[pose.sensor]) {
        tracking::boresight(boresighted_[pose.sensor].emplace(format_.frame), pose.q_source_sensor);
    }
    if (const auto truth = std::exchange(truth_, std::nullopt)) {
        next_.truth(pose.sensor, pose.time, framed(pose, *truth, nullptr));
    }
    next_.pose(framed(pose));
}

/// Without a frame, the pose stays the same in every digit.
PoseStages::Pose PoseStages::framed(const Pose& pose) const {
    const Pose at_tip = format_.tips.at_tip(pose);
    if (pose.sensor < boresighted_.size() && boresighted_[pose.sensor]) {
        return tracking::in_frame(at_tip, *boresighted_[pose.sensor]);
    }
    return is_aligned_ ? tracking::in_frame(at_tip, format_.frame) : at_tip;
}

TruePose PoseStages::framed(const Pose& pose, const TruePose& truth, const TruePose* reference) const {
    Pose seen;
    seen.sensor = pose.sensor;
    seen.position_m = truth.position_m;
    seen.q_source_sensor = truth.q_source_sensor;
    if (relative_ && reference != nullptr) {
        const Quat<double> to_reference = reference->q_source_sensor.conjugate();
        seen.position_m = to_reference * (truth.position_m - reference->position_m);
        seen.q_source_sensor = to_reference * truth.q_source_sensor;
    }
    seen = framed(seen);
    return {seen.position_m, seen.q_source_sensor};
}

/// The tip moves with the rotation of the tool.
void PoseStages::turn_rates(const Pose& pose, Vec3<double>& velocity_m_s, Vec3<double>& rate_rad_s) const {
    const Quat<double> to_alignment = format_.frame.q_source_alignment.conjugate();
    const Vec3<double> lever = format_.tips.at_tip(pose).position_m - pose.position_m;
    velocity_m_s = to_alignment * Vec3<double>(velocity_m_s + rate_rad_s.cross(lever));
    rate_rad_s = to_alignment * rate_rad_s;
}

}  // namespace tricoil::host

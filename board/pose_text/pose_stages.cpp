#include "board/pose_text/pose_stages.hpp"

namespace tricoil::host {

PoseStages::PoseStages(const OutputOptions& options, tracking::TrackerTap<double>& next)
    : next_(next), format_(make_output_format(options)), has_frame_(options.boresight || !options.align_points.empty()) {
    if (options.relative_to > 0) {
        relative_.emplace(static_cast<std::uint8_t>(options.relative_to - 1), [this](const Pose& pose) { pass(pose); });
    }
}

void PoseStages::do_begin(const Settings& settings) {
    if (relative_) {
        relative_->reset();
    }
    next_.begin(settings);
}

void PoseStages::do_pose(const Pose& estimate) { relative_ ? relative_->take(estimate) : pass(estimate); }

void PoseStages::pass(const Pose& pose) {
    if (format_.boresight_first && pose.valid()) {
        tracking::boresight(format_.frame, pose.q_source_sensor);
        format_.boresight_first = false;
    }
    next_.pose(framed(pose));
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

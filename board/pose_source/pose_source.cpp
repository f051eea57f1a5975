#include "board/pose_source/pose_source.hpp"

#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::host {

tracking::PoseEstimate<double> PoseQueue::pop() {
    const tracking::PoseEstimate<double> oldest = poses_.front();
    poses_.pop_front();
    return oldest;
}

void PoseQueue::do_pose(const tracking::PoseEstimate<double>& estimate) {
    if (poses_.size() == kCapacity) {
        poses_.pop_front();
        ++dropped_;
    }
    poses_.push_back(estimate);
}

PoseSource::Event PoseSource::poll(Microseconds patience, tracking::PoseEstimate<double>& pose) {
    const HostTime end = drivers::host_now() + patience;
    do {
        ended_ = ended_ || !do_advance();
    } while (queue_.empty() && !ended_ && drivers::host_now() < end);
    if (queue_.empty()) {
        return ended_ ? Event::end : Event::none;
    }
    pose = queue_.pop();
    if (pose.sensor >= outputs_.size()) {
        return Event::pose;
    }
    Output& output = outputs_[pose.sensor];
    if (pose.valid()) {
        output.attitude = pose.q_source_sensor;
    }
    if (output.frame) {
        pose = tracking::in_frame(pose, *output.frame);
    }
    return Event::pose;
}

bool PoseSource::set_hemisphere(std::size_t sensor, const Vec3<double>& towards) {
    return sensor < outputs_.size() && towards.allFinite() && !towards.isZero(0) && do_set_hemisphere(sensor, towards);
}

bool PoseSource::set_tip(std::size_t sensor, const Vec3<double>& tip_m) {
    if (sensor >= outputs_.size() || !tip_m.allFinite()) {
        return false;
    }
    auto& frame = outputs_[sensor].frame;
    frame = frame.value_or(tracking::OutputFrame<double>{});
    frame->tip_m = tip_m;
    return true;
}

bool PoseSource::boresight(std::size_t sensor) {
    if (sensor >= outputs_.size() || !outputs_[sensor].attitude) {
        return false;
    }
    Output& output = outputs_[sensor];
    output.frame = output.frame.value_or(tracking::OutputFrame<double>{});
    tracking::boresight(*output.frame, *output.attitude);
    return true;
}

}  // namespace tricoil::host

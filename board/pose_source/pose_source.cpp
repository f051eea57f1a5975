#include "board/pose_source/pose_source.hpp"

#include "core/tracking/hemisphere.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::host {

const tracking::PoseEstimate<double>& PoseQueue::pop() {
    const std::size_t oldest = begin_;
    begin_ = (begin_ + 1) % kCapacity;
    --size_;
    return ring_[oldest];
}

void PoseQueue::do_pose(const tracking::PoseEstimate<double>& estimate) {
    if (size_ == kCapacity) {
        (void)pop();
        ++dropped_;
    }
    ring_[(begin_ + size_) % kCapacity] = estimate;
    ++size_;
}

PoseSource::PoseSource(const MakeSource& make, bool realtime)
    : source_(make(queue_)), loop_(*source_, LoopParams{.realtime = realtime}) {}

/// While poses are queued, a source whose data would be lost is served without waiting: otherwise a backlog would never become
/// shorter.
PoseSource::Event PoseSource::poll(Microseconds patience, tracking::PoseEstimate<double>& pose) {
    const HostTime end = drivers::host_now() + patience;
    Microseconds left = queue_.empty() ? patience : Microseconds{0};
    while (!ended_ && (queue_.empty() || source_->is_lossy())) {
        ended_ = !loop_.step(left);
        left = end - drivers::host_now();
        if (!queue_.empty() || left.count() <= 0) {
            break;
        }
    }
    if (queue_.empty()) {
        return ended_ ? Event::end : Event::none;
    }
    pose = queue_.pop();
    if (pose.sensor >= outputs_.size()) {
        return Event::pose;
    }
    Output& output = outputs_[pose.sensor];
    output.attitude = pose.valid() ? std::optional(pose.q_source_sensor) : std::nullopt;
    pose = tips_.at_tip(pose);
    if (output.frame) {
        pose = tracking::in_frame(pose, *output.frame);
    }
    return Event::pose;
}

bool PoseSource::set_hemisphere(std::size_t sensor, const Vec3<double>& towards) {
    return sensor < outputs_.size() && tracking::is_hemisphere(towards) && !towards.isZero(0) &&
           source_->set_hemisphere(sensor, towards);
}

bool PoseSource::set_tip(std::size_t sensor, const Vec3<double>& tip_m, const Mat3<double>& covariance_m2) {
    const ToolTip tip{static_cast<std::uint8_t>(std::min<std::size_t>(sensor, tracking::kMaxSensors)), tip_m, covariance_m2};
    return tips_.set(tip).empty();
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

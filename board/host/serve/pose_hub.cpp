#include "board/host/serve/pose_hub.hpp"

#include <algorithm>
#include <utility>

namespace tricoil::host {

PoseHub::Cursor PoseHub::cursor() const {
    const std::lock_guard lock(mutex_);
    return {count_, 0};
}

void PoseHub::read(Cursor& cursor, std::vector<ServedPose>& out) const {
    const std::lock_guard lock(mutex_);
    const std::uint64_t oldest = count_ > kCapacity ? count_ - kCapacity : 0;
    if (cursor.next < oldest) {
        cursor.missed += oldest - cursor.next;
        cursor.next = oldest;
    }
    for (; cursor.next < count_; ++cursor.next) {
        out.push_back(ring_[cursor.next % kCapacity]);
    }
}

std::vector<ServedPose> PoseHub::newest() const {
    const std::lock_guard lock(mutex_);
    std::vector<ServedPose> poses;
    for (const auto& newest : newest_) {
        if (newest) {
            poses.push_back(*newest);
            if (utc_now() - newest->utc > SilenceWatch::kLimit) {
                poses.back().pose.flags.set(tracking::PoseFlag::stale);
            }
        }
    }
    return poses;
}

void PoseHub::set_health(const LinkHealth& health) {
    const std::lock_guard lock(mutex_);
    health_ = health;
}

LinkHealth PoseHub::health() const {
    const std::lock_guard lock(mutex_);
    return health_;
}

Json PoseHub::newer_levels(std::uint64_t& seen) const {
    const std::lock_guard lock(mutex_);
    return levels_.newer(seen);
}

int PoseHub::sensors() const {
    const std::lock_guard lock(mutex_);
    return sensors_;
}

std::vector<Vec3<double>> PoseHub::confinement() const {
    const std::lock_guard lock(mutex_);
    return confinement_;
}

void PoseHub::do_begin(const Settings& settings) {
    const std::lock_guard lock(mutex_);
    sensors_ = settings.sensors;
    const auto& common = settings.tracker.common;
    confinement_.assign(common.confined ? static_cast<std::size_t>(sensors_) : 0, common.hemisphere);
    clock_.begin(common.window_s);
}

void PoseHub::do_column(const MeasuredColumn<double>& column) {
    const std::lock_guard lock(mutex_);
    levels_.take(column);
}

void PoseHub::do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) {
    const std::lock_guard lock(mutex_);
    if (sensor < confinement_.size()) {
        confinement_[sensor] = towards;
    }
}

void PoseHub::do_pose(const tracking::PoseEstimate<double>& estimate) {
    {
        const std::lock_guard lock(mutex_);
        sensors_ = std::max(sensors_, estimate.sensor + 1);
        ServedPose& served = ring_[count_ % kCapacity];
        served.pose = estimate;
        served.utc = clock_.utc(estimate.time);
        served.epoch = clock_.epoch();
        served.expected_error_m = expected_.after(estimate);
        served.truth = std::exchange(truth_, std::nullopt);
        ++count_;
        if (estimate.sensor < newest_.size()) {
            newest_[estimate.sensor] = served;
        }
    }
    if (notify_) {
        notify_();
    }
}

}  // namespace tricoil::host

// Converts a stream of poses of several sensors to poses relative to one of them, at equal times.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

/// A pose waits for the first pose of the reference that is not older. If their times differ, the reference is interpolated
/// between its poses before and after, at most kLongestGap apart. If the reference has no pose within kPatience, or no such pair,
/// the pose is relative to the newest pose of the reference and flagged stale. Without any pose of the reference there
/// is no position, and the attitude is zero. The order of the poses of one sensor is kept. The signs of the quaternions of one
/// sensor are continuous.
class RelativePoses {
public:
    using Pose = tracking::PoseEstimate<double>;
    using Sink = std::function<void(const Pose&)>;
    static constexpr Microseconds kPatience{50'000};
    static constexpr Microseconds kLongestGap{50'000};

    /// reference: index of the sensor. `sink` receives the relative poses, those of the reference included.
    RelativePoses(std::uint8_t reference, Sink sink) : reference_(reference), sink_(std::move(sink)) {}

    /// Gives the sink each pose that is complete now: none, this one, or several.
    void take(const Pose& estimate);
    /// Gives the sink the waiting poses, then forgets all: the poses end, or the trackers start again.
    void finish();

private:
    void remember(const Pose& pose);
    void release(DeviceTime now);
    void give_oldest();
    [[nodiscard]] Pose finished(const Pose& pose) const;
    [[nodiscard]] std::optional<Pose> reference_at(DeviceTime time) const;
    void give(Pose pose);

    std::uint8_t reference_;
    Sink sink_;
    std::deque<Pose> history_;  // of the reference, oldest first
    std::deque<Pose> waiting_;  // of the others, oldest first
    std::array<std::optional<Quat<double>>, tracking::kMaxSensors> last_;
};

}  // namespace tricoil::host

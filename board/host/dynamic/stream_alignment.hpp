// Brings a tracker's poses and a reference's together: clocks, world frames, and where the sensor sits on the reference body.
#pragma once

#include <optional>

#include "board/host/dynamic/pose_stream.hpp"
#include "core/geometry/quaternion.hpp"

namespace tricoil::host {

/// tracker pose(t) = world * reference pose(t + time_offset - lag) * mount.
struct StreamAlignment {
    double time_offset_s = 0;
    double lag_s = 0;                                 // only where the offset was given: what the tracker is late
    Quat<double> q_world = Quat<double>::Identity();  // reference's world to the tracker's source frame
    Vec3<double> world_m = Vec3<double>::Zero();
    Quat<double> q_mount = Quat<double>::Identity();  // sensor on the reference body
    Vec3<double> mount_m = Vec3<double>::Zero();

    /// What the tracker should have read, and how its sensor moved: not the reference body, from which it may stand off. The lag
    /// is an error of the tracker and left out.
    [[nodiscard]] MovingPose applied(const PoseStream& reference, double tracker_time_s) const;
};

/// Estimates all of it. Start: time offset within +-2 s by the best correlation of angular speeds, which no frame changes;
/// attitudes from q_tracker q_mount^-1 = q_world q_reference, linear in the two unknown quaternions; then positions, linear in
/// the two vectors. All thirteen parameters are then refined together by Levenberg-Marquardt on position and attitude errors, a
/// milliradian weighing as much as 0.5 mm. `given_offset_s` fixes the clocks instead: what is left of the offset is the lag,
/// fitted along so that no frame takes a part of it. Throws InputError: streams that do not overlap for a second, motion that
/// does not turn about two axes, an offset beyond 2 s, streams whose angular speeds do not agree (correlation below 0.7) or that
/// no frames bring together (residual above half of the motion).
StreamAlignment align_streams(const PoseStream& tracker, const PoseStream& reference, std::optional<double> given_offset_s);

}  // namespace tricoil::host

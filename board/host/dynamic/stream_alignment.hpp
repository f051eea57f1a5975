// Aligns the poses of a tracker and of a reference: clock offset, world frame, and mount of the sensor on the reference body.
#pragma once

#include <optional>

#include "board/host/dynamic/pose_stream.hpp"
#include "core/linear/quaternion.hpp"

namespace tricoil::host {

/// tracker pose(t) = world * reference pose(t + time_offset - lag) * mount.
struct StreamAlignment {
    double time_offset_s = 0;
    double lag_s = 0;                                 // lag of the tracker; only if the offset was given
    Quat<double> q_world = Quat<double>::Identity();  // reference's world to the tracker's source frame
    Vec3<double> world_m = Vec3<double>::Zero();
    Quat<double> q_mount = Quat<double>::Identity();  // sensor on the reference body
    Vec3<double> mount_m = Vec3<double>::Zero();

    /// Expected pose and motion of the tracker's sensor, with its offset from the reference body. The lag is an error of the
    /// tracker and is not applied.
    [[nodiscard]] MovingPose applied(const PoseStream& reference, double tracker_time_s) const;
};

/// Estimates all parameters. Start values:
/// - time offset within +-2 s: best correlation of angular speeds, which do not depend on coordinate frames;
/// - attitudes from q_tracker q_mount^-1 = q_world q_reference, linear in the two unknown quaternions;
/// - positions, linear in the two vectors.
/// Then Levenberg-Marquardt refines all thirteen parameters on position and attitude errors; 1 mrad counts as 0.5 mm.
/// `given_offset_s` fixes the clock offset. The remaining offset is the lag, which is fitted too, so that it does not bias the
/// coordinate frames. Throws InputError if the motion does not rotate about two axes, the streams overlap in fewer than 20 poses,
/// or the residual is above half of the motion. If the offset is estimated, also if the streams overlap for less than a second,
/// the offset is beyond 2 s, or the angular speeds do not agree (correlation below 0.7).
StreamAlignment align_streams(const PoseStream& tracker, const PoseStream& reference, std::optional<double> given_offset_s);

}  // namespace tricoil::host

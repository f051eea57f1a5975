// How source and sensor are mounted: what lies between the stage's numbers and the pose that the tracker sees.
#pragma once

#include "board/host/calibration/pose_set.hpp"
#include "board/support/rigid.hpp"
#include "core/geometry/types.hpp"
#include "core/solver/refine.hpp"

namespace tricoil::host {

/// The pose of the sensor's frame in the source's: source_stage takes stage to source components, mount_sensor takes sensor to
/// mount components, the stage is between them.
inline solver::RigidPose<double> true_pose(const Rigid& source_stage, const MeasuredPose& pose, const Rigid& mount_sensor) {
    const Vec3<double> in_stage = pose.stage_position_m + pose.stage_rotation * mount_sensor.translation_m;
    const Mat3<double> turned = source_stage.rotation * pose.stage_rotation * mount_sensor.rotation;
    return {source_stage.translation_m + source_stage.rotation * in_stage, Quat<double>(turned).normalized()};
}

}  // namespace tricoil::host

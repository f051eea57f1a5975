// Pose of the sensor from the pose of a stage and the fixtures of source and sensor.
#pragma once

#include "board/host/calibration/pose_set.hpp"
#include "board/support/calibration_file.hpp"
#include "core/field/general_dipole.hpp"
#include "core/linear/matrix.hpp"
#include "core/solver/refine.hpp"

namespace tricoil::host {

/// Pose of the sensor in the source frame. source_stage: stage to source components; mount_sensor: sensor to mount components.
inline solver::RigidPose<double> true_pose(const Rigid& source_stage, const MeasuredPose& pose, const Rigid& mount_sensor,
                                           const StageErrors& errors = {}) {
    const Vec3<double> in_stage =
        errors.position_m(pose.stage_position_m, pose.stage_rotation) + pose.stage_rotation * mount_sensor.translation_m;
    const Mat3<double> turned = source_stage.rotation * pose.stage_rotation * mount_sensor.rotation;
    return {source_stage.translation_m + source_stage.rotation * in_stage, Quat<double>(turned).normalized()};
}

/// Couplings at a true pose, with those of the stray field.
inline Mat3<double> couplings_at(const field::GeneralDipole<double>& coils, const StageErrors& errors,
                                 const solver::RigidPose<double>& pose) {
    const Mat3<double> o = pose.q_source_sensor.toRotationMatrix().transpose();
    return field::signal_matrix<double>(coils, pose.position_m, o) + coils.sensor_sensitivity.transpose() * o * errors.stray;
}

}  // namespace tricoil::host

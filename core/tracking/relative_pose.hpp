// Pose of a sensor relative to a reference sensor on the same body or patient, with covariance.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/geometry/rotations.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::tracking {

/// Position and attitude of `estimate` in the frame of the sensor of `reference`. Both must belong to one time, that of
/// `estimate`. The errors of two sensors count as independent. A small rotation r of the reference about the source axes moves
/// the relative position by R^T (d x r), with R its attitude and d the vector between the sensors: in terms of Lie groups the
/// covariance of the reference passes through an adjoint. A sensor relative to itself has the pose zero without uncertainty.
///
/// The pose has the flags of both, so it is invalid if one of them is. The distortion is the root of the sum of squares, the SNR
/// the lower one. There is no error budget. The rest is that of `estimate`.
template <typename Scalar>
PoseEstimate<Scalar> relative_pose(const PoseEstimate<Scalar>& estimate, const PoseEstimate<Scalar>& reference) {
    const Quat<Scalar> to_reference = reference.q_source_sensor.conjugate();
    const Vec3<Scalar> between = estimate.position_m - reference.position_m;
    PoseEstimate<Scalar> seen = estimate;
    seen.position_m = to_reference * between;
    seen.q_source_sensor = (to_reference * estimate.q_source_sensor).normalized();
    const Mat3<Scalar> turn = to_reference.toRotationMatrix();
    Mat6<Scalar> of_sensor = Mat6<Scalar>::Zero();
    of_sensor.template topLeftCorner<3, 3>() = turn;
    of_sensor.template bottomRightCorner<3, 3>() = turn;
    Mat6<Scalar> of_reference = -of_sensor;
    of_reference.template topRightCorner<3, 3>() = turn * geometry::skew<Scalar>(between);
    seen.covariance =
        of_sensor * estimate.covariance * of_sensor.transpose() + of_reference * reference.covariance * of_reference.transpose();
    seen.flags |= reference.flags;
    seen.state = reference.state == TrackerState::tracking ? estimate.state : reference.state;
    seen.distortion_chi_square = std::max(estimate.distortion_chi_square, reference.distortion_chi_square);
    seen.distortion_m = std::hypot(estimate.distortion_m, reference.distortion_m);
    seen.snr_db = std::min(estimate.snr_db, reference.snr_db);
    seen.predicted_error.reset();
    if (estimate.sensor == reference.sensor) {
        seen.covariance.setZero();
        seen.distortion_m = reference.distortion_m;
    }
    clear_unknown_position(seen);
    return seen;
}

/// Pose between two poses of one sensor: position and attitude linear in time. The covariance is the mean of both with the same
/// weights, which is not smaller than that of the interpolated pose, whatever the correlation. Flags of both.
template <typename Scalar>
PoseEstimate<Scalar> interpolated_pose(const PoseEstimate<Scalar>& before, const PoseEstimate<Scalar>& after, DeviceTime time) {
    const Scalar weight = static_cast<Scalar>(to_seconds(time - before.time) / to_seconds(after.time - before.time));
    PoseEstimate<Scalar> pose = after;
    pose.time = time;
    pose.position_m = (1 - weight) * before.position_m + weight * after.position_m;
    pose.q_source_sensor = before.q_source_sensor.slerp(weight, after.q_source_sensor).normalized();
    pose.covariance = (1 - weight) * before.covariance + weight * after.covariance;
    pose.flags |= before.flags;
    return pose;
}

}  // namespace tricoil::tracking

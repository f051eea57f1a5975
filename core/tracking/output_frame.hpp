// Output settings: tip offset of a tool, alignment frame and boresight.
#pragma once

#include "core/base/status.hpp"
#include "core/geometry/rotations.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::tracking {

/// Applied to a pose in the order of the members. The default changes nothing.
template <typename Scalar>
struct OutputFrame {
    Vec3<Scalar> tip_m = Vec3<Scalar>::Zero();                   // of the tool, sensor frame
    Quat<Scalar> q_sensor_boresight = Quat<Scalar>::Identity();  // from boresight axes to sensor axes
    Vec3<Scalar> origin_m = Vec3<Scalar>::Zero();                // of the alignment frame, source frame
    Quat<Scalar> q_source_alignment = Quat<Scalar>::Identity();  // v_source = q v_alignment
};

/// Converts `estimate` to `frame`: position of the tip in the alignment frame, attitude of the boresighted sensor relative to it.
/// A rotation error r moves the tip by r x (q t), so the tip's covariance includes that of the attitude.
template <typename Scalar>
PoseEstimate<Scalar> in_frame(const PoseEstimate<Scalar>& estimate, const OutputFrame<Scalar>& frame) {
    const Vec3<Scalar> lever = estimate.q_source_sensor * frame.tip_m;
    const Quat<Scalar> to_alignment = frame.q_source_alignment.conjugate();
    PoseEstimate<Scalar> seen = estimate;
    seen.position_m = to_alignment * (estimate.position_m + lever - frame.origin_m);
    seen.q_source_sensor = (to_alignment * estimate.q_source_sensor * frame.q_sensor_boresight).normalized();
    Mat6<Scalar> jacobian = Mat6<Scalar>::Zero();
    const Mat3<Scalar> turn = to_alignment.toRotationMatrix();
    jacobian.template topLeftCorner<3, 3>() = turn;
    jacobian.template topRightCorner<3, 3>() = -turn * geometry::skew<Scalar>(lever);
    jacobian.template bottomRightCorner<3, 3>() = turn;
    seen.covariance = jacobian * estimate.covariance * jacobian.transpose();
    clear_unknown_position(seen);
    return seen;
}

/// Sets the boresight such that the present attitude reads `reading` (identity: zero angles) in `frame`.
template <typename Scalar>
void boresight(OutputFrame<Scalar>& frame, const Quat<Scalar>& q_source_sensor,
               const Quat<Scalar>& reading = Quat<Scalar>::Identity()) {
    frame.q_sensor_boresight = (q_source_sensor.conjugate() * frame.q_source_alignment * reading).normalized();
}

/// Alignment frame from three points touched with the tip (source frame, m): its origin, a point on the positive x axis, and a
/// point in the x-y plane with positive y. Errors: not_finite; degenerate if the points are on a line or less than 1 mm apart.
template <typename Scalar>
Status align(OutputFrame<Scalar>& frame, const Vec3<Scalar>& origin_m, const Vec3<Scalar>& on_x_m,
             const Vec3<Scalar>& towards_y_m) {
    constexpr Scalar kShortest_m = Scalar(1e-3);
    constexpr Scalar kFlattest = Scalar(0.01);  // sine of the angle at the origin
    const Vec3<Scalar> x = on_x_m - origin_m;
    const Vec3<Scalar> y = towards_y_m - origin_m;
    if (!(x.allFinite() && y.allFinite() && origin_m.allFinite())) {
        return {StatusCode::not_finite, "alignment points must be finite"};
    }
    const Vec3<Scalar> normal = x.cross(y);
    if (x.norm() < kShortest_m || y.norm() < kShortest_m || normal.norm() < kFlattest * x.norm() * y.norm()) {
        return {StatusCode::degenerate, "alignment points must be distinct and not on one line"};
    }
    Mat3<Scalar> axes;  // columns: the alignment frame's axes in the source frame
    axes.col(0) = x.normalized();
    axes.col(2) = normal.normalized();
    axes.col(1) = axes.col(2).cross(axes.col(0));
    frame.origin_m = origin_m;
    frame.q_source_alignment = Quat<Scalar>(axes).normalized();
    return {};
}

}  // namespace tricoil::tracking

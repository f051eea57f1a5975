#include "core/solver/previous_measurement.hpp"

#include <cmath>

#include "core/base/precision.hpp"

namespace tricoil::solver {
namespace {

constexpr Status kNotFinite{StatusCode::not_finite, "signal matrix or previous pose contains NaN or infinity"};
constexpr Status kTooFar{StatusCode::not_converged, "previous pose is too far from the measurement to linearise about"};
constexpr Status kPole{StatusCode::not_converged, "angle form is singular at elevation +-90 degrees; use the vector form"};

template <typename Scalar>
bool is_finite(const AnglePose<Scalar>& pose) {
    const auto& [position, attitude] = pose;
    return std::isfinite(position.range_m + position.azimuth_rad + position.elevation_rad + attitude.azimuth_rad +
                         attitude.elevation_rad + attitude.roll_rad);
}

/// Applies the increments as small rotations: to u within the tracking frame, to O by the passive rotation (phi0, theta0, psi0).
template <typename Scalar>
VectorPose<Scalar> turn(const VectorPose<Scalar>& previous, const Mat3<Scalar>& p, const TrackingIncrements<Scalar>& step) {
    // Tracking axes are the rows of p; u is the first. Azimuth turns u towards y, elevation towards -z. The increments are added
    // and u is normalised, not rotated by the angle: a0 = tan(g) + g^3 / 2 is closer to the tangent than to the angle, by g^3
    // / 3.
    const Vec3<Scalar> step_across = p.transpose() * Vec3<Scalar>(0, step.position_azimuth, -step.position_elevation);
    // P^ O^^T O P^^T = exp(-[r0]x), hence O = O^ exp(-[P^^T r0]x).
    // Roll: mean of both forms. The rotation of the line of sight adds 3 u_y u_z (twice W32 / k = 3/2 u_y u_z) to each form. A
    // single form depends on the choice of p and has an error of 80 um; the mean has an error of 0.5 um (example III, two
    // passes).
    const Vec3<Scalar> rotation = p.transpose() * Vec3<Scalar>(step.mean_roll, step.rotation.y(), step.rotation.z());
    const Quat<Scalar> turn_o = geometry::rotation_vector_to_quaternion<Scalar>(-rotation);
    VectorPose<Scalar> next;
    next.range_m = step.range_m;
    next.direction = (previous.direction + step_across).normalized();
    next.attitude = Quat<Scalar>(Mat3<Scalar>(previous.attitude * turn_o.toRotationMatrix())).normalized().toRotationMatrix();
    return next;
}

}  // namespace

template <typename Scalar>
Result<AnglePose<Scalar>> add_increments(const AnglePose<Scalar>& previous, const TrackingIncrements<Scalar>& step) {
    const auto& [position, attitude] = previous;
    AnglePose<Scalar> next = previous;
    next.position.range_m = step.range_m;
    next.position.azimuth_rad += step.position_azimuth / std::cos(position.elevation_rad);
    next.position.elevation_rad += step.position_elevation;

    const Vec3<Scalar> turned = geometry::rotation_z(attitude.azimuth_rad - position.azimuth_rad) *
                                geometry::rotation_y(-position.elevation_rad) * step.rotation;
    const Scalar roll_step = turned.x() / std::cos(attitude.elevation_rad);
    next.attitude.roll_rad += roll_step;
    next.attitude.elevation_rad += turned.y();
    next.attitude.azimuth_rad += turned.z() + roll_step * std::sin(attitude.elevation_rad);
    if (!is_finite(next)) {
        return kPole;
    }
    return next;
}

template <typename Scalar>
Result<TrackingIncrements<Scalar>> tracking_increments(const Mat3<Scalar>& w, Scalar coupling_constant) {
    if (!w.allFinite()) {
        return kNotFinite;
    }
    const Scalar k = w(0, 0);  // (15): rho~ = cbrt(C / W11), so C / rho~^3 is W11 itself
    if (!(k > 0)) {
        return kTooFar;
    }
    TrackingIncrements<Scalar> step;
    step.range_m = std::cbrt(coupling_constant / k);
    step.position_azimuth = 2 * (2 * w(0, 1) - w(1, 0)) / (3 * k);
    step.position_elevation = 2 * (w(2, 0) - 2 * w(0, 2)) / (3 * k);
    step.rotation << 2 * w(2, 1) / k, 2 * (w(2, 0) - w(0, 2)) / k, 2 * (w(0, 1) - w(1, 0)) / k;
    step.mean_roll = (w(2, 1) - w(1, 2)) / k;
    return step;
}

template <typename Scalar>
Result<AnglePose<Scalar>> step_angles(const Mat3<Scalar>& x, Scalar coupling_constant, const AnglePose<Scalar>& previous,
                                      int passes) {
    AnglePose<Scalar> pose = previous;
    for (int pass = 0; pass < passes; ++pass) {
        const Mat3<Scalar> p = geometry::line_of_sight_rotation(pose.position.azimuth_rad, pose.position.elevation_rad);
        const Mat3<Scalar> w = p * geometry::attitude_matrix(pose.attitude).transpose() * x * p.transpose();
        const auto step = tracking_increments(w, coupling_constant);
        if (!step.ok()) {
            return step.status();
        }
        const auto next = add_increments(pose, *step);
        if (!next.ok()) {
            return next.status();
        }
        pose = *next;
    }
    return pose;
}

template <typename Scalar>
Result<VectorPose<Scalar>> step_vectors(const Mat3<Scalar>& x, Scalar coupling_constant, const VectorPose<Scalar>& previous,
                                        int passes) {
    VectorPose<Scalar> pose = previous;
    for (int pass = 0; pass < passes; ++pass) {
        Mat3<Scalar> p;  // any proper rotation whose first row is u: the result does not depend on the choice
        p << pose.direction.transpose(), geometry::transverse_axes(pose.direction).transpose();
        const Mat3<Scalar> w = p * pose.attitude.transpose() * x * p.transpose();
        const auto step = tracking_increments(w, coupling_constant);
        if (!step.ok()) {
            return step.status();
        }
        pose = turn(pose, p, *step);
    }
    return pose;
}

template Result<TrackingIncrements<float>> tracking_increments(const Mat3<float>&, float);
template Result<AnglePose<float>> add_increments(const AnglePose<float>&, const TrackingIncrements<float>&);
template Result<AnglePose<float>> step_angles(const Mat3<float>&, float, const AnglePose<float>&, int);
template Result<VectorPose<float>> step_vectors(const Mat3<float>&, float, const VectorPose<float>&, int);
#if TRICOIL_SCALARS & 2  // double
template Result<TrackingIncrements<double>> tracking_increments(const Mat3<double>&, double);
template Result<AnglePose<double>> add_increments(const AnglePose<double>&, const TrackingIncrements<double>&);
template Result<AnglePose<double>> step_angles(const Mat3<double>&, double, const AnglePose<double>&, int);
template Result<VectorPose<double>> step_vectors(const Mat3<double>&, double, const VectorPose<double>&, int);
#endif

}  // namespace tricoil::solver

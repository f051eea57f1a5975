#include "core/error_model/exact_step.hpp"

#include <cmath>

#include "core/base/precision.hpp"

namespace tricoil::error_model {

template <typename Scalar>
RelativePose<Scalar> relative_pose(const solver::AnglePose<Scalar>& real, const solver::AnglePose<Scalar>& previous) {
    const Scalar b = real.position.elevation_rad;
    const Scalar b_hat = previous.position.elevation_rad;
    const Scalar da = real.position.azimuth_rad - previous.position.azimuth_rad;
    // P^ u written out: it depends only on the difference of azimuths. 1 - cos(da) as 2 sin^2(da / 2), to avoid cancellation.
    const Scalar half = std::sin(da / 2);
    const Scalar versine = 2 * half * half;
    RelativePose<Scalar> relative;
    relative.direction << std::cos(b - b_hat) - std::cos(b) * std::cos(b_hat) * versine, std::cos(b) * std::sin(da),
        -(std::sin(b - b_hat) + std::cos(b) * std::sin(b_hat) * versine);
    const Mat3<Scalar> p_hat = geometry::line_of_sight_rotation(previous.position.azimuth_rad, b_hat);
    relative.rotation = p_hat * geometry::attitude_matrix(previous.attitude).transpose() *
                        geometry::attitude_matrix(real.attitude) * p_hat.transpose();
    return relative;
}

template <typename Scalar>
Result<solver::TrackingIncrements<Scalar>> exact_increments(const RelativePose<Scalar>& relative, Scalar range_m) {
    const Vec3<Scalar>& u = relative.direction;
    const Mat3<Scalar>& q = relative.rotation;
    const Vec3<Scalar> v = q * u;
    // 2 W_ij / k = 3 v_i u_j - Q_ij.
    const auto w = [&](Index i, Index j) { return 3 * v(i) * u(j) - q(i, j); };
    const Scalar kappa = w(0, 0);
    if (!(kappa > 0)) {
        return Status{StatusCode::not_converged, "previous pose is too far from the real one: kappa is not positive"};
    }
    solver::TrackingIncrements<Scalar> step;
    step.range_m = range_m * std::cbrt(2 / kappa);                      // (15)
    step.position_azimuth = 2 * (2 * w(0, 1) - w(1, 0)) / (3 * kappa);  // (16), here and below
    step.position_elevation = 2 * (w(2, 0) - 2 * w(0, 2)) / (3 * kappa);
    step.rotation << 2 * w(2, 1) / kappa, 2 * (w(2, 0) - w(0, 2)) / kappa, 2 * (w(0, 1) - w(1, 0)) / kappa;
    step.mean_roll = (w(2, 1) - w(1, 2)) / kappa;
    return step;
}

template <typename Scalar>
Result<PoseAngleError<Scalar>> exact_step_error(const solver::AnglePose<Scalar>& real,
                                                const solver::AnglePose<Scalar>& linearised_about,
                                                const solver::AnglePose<Scalar>& estimate) {
    const auto step = exact_increments(relative_pose(real, linearised_about), real.position.range_m);
    if (!step.ok()) {
        return step.status();
    }
    const auto& [position, attitude] = estimate;
    PoseAngleError<Scalar> error;
    error.position.range_m = real.position.range_m - step->range_m;
    // (17): divided by the cosine of the estimated elevation.
    error.position.azimuth_rad =
        real.position.azimuth_rad - position.azimuth_rad - step->position_azimuth / std::cos(position.elevation_rad);
    error.position.elevation_rad = real.position.elevation_rad - position.elevation_rad - step->position_elevation;

    // (18) row by row: p and q are the rotations about x and y of the yawed frame, s about z.
    const Scalar yaw = attitude.azimuth_rad - position.azimuth_rad;
    const Scalar cb = std::cos(position.elevation_rad);
    const Scalar sb = std::sin(position.elevation_rad);
    const Scalar x = cb * step->rotation.x() + sb * step->rotation.z();
    const Scalar p = std::cos(yaw) * x + std::sin(yaw) * step->rotation.y();
    const Scalar q = std::cos(yaw) * step->rotation.y() - std::sin(yaw) * x;
    const Scalar s = cb * step->rotation.z() - sb * step->rotation.x();
    error.attitude.roll_rad = real.attitude.roll_rad - attitude.roll_rad - p / std::cos(attitude.elevation_rad);
    error.attitude.elevation_rad = real.attitude.elevation_rad - attitude.elevation_rad - q;
    error.attitude.azimuth_rad = real.attitude.azimuth_rad - attitude.azimuth_rad - s - p * std::tan(attitude.elevation_rad);
    if (!std::isfinite(error.position.azimuth_rad + error.attitude.roll_rad + error.attitude.azimuth_rad)) {
        return Status{StatusCode::not_converged, "angle form is singular at elevation +-90 degrees"};
    }
    return error;
}

template RelativePose<float> relative_pose(const solver::AnglePose<float>&, const solver::AnglePose<float>&);
template Result<solver::TrackingIncrements<float>> exact_increments(const RelativePose<float>&, float);
template Result<PoseAngleError<float>> exact_step_error(const solver::AnglePose<float>&, const solver::AnglePose<float>&,
                                                        const solver::AnglePose<float>&);
#if TRICOIL_SCALARS & 2  // double
template RelativePose<double> relative_pose(const solver::AnglePose<double>&, const solver::AnglePose<double>&);
template Result<solver::TrackingIncrements<double>> exact_increments(const RelativePose<double>&, double);
template Result<PoseAngleError<double>> exact_step_error(const solver::AnglePose<double>&, const solver::AnglePose<double>&,
                                                         const solver::AnglePose<double>&);
#endif

}  // namespace tricoil::error_model

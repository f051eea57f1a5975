#include "core/error_model/sampling_error.hpp"

#include "core/base/precision.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/geometry/angles.hpp"
#include "core/solver/pose_covariance.hpp"

namespace tricoil::error_model {
namespace {

/// The coupling constant cancels: it scales dX and J alike.
template <typename Scalar>
constexpr Scalar kUnitCoupling = 1;

/// (J^T J)^-1 g in closed form: the covariance (14) for unit noise is (J^T J)^-1.
template <typename Scalar>
PoseError<Scalar> solve_normal_equations(const Vec3<Scalar>& position_m, const Vec6<Scalar>& g) {
    const Scalar range = position_m.norm();
    const Scalar k = field::coupling_strength(kUnitCoupling<Scalar>, range);
    return solver::pose_covariance<Scalar>(k, range, position_m / range, Scalar(1)) * g;
}

/// Second time derivative of the dipole field B = C (3 (r.m) r - m r^2) / (2 r^5) of coil j at a point that moves uniformly.
template <typename Scalar>
Vec3<Scalar> field_curvature(const Vec3<Scalar>& r, const Vec3<Scalar>& v, Index j) {
    const Scalar n = r.squaredNorm();
    const Scalar dn = 2 * r.dot(v);
    const Scalar ddn = 2 * v.squaredNorm();
    const Scalar n3 = 1 / (n * std::sqrt(n));  // n^(-3/2)
    const Scalar n5 = n3 / n;
    const Scalar df = Scalar(-2.5) * n5 / n * dn;
    const Scalar ddf = Scalar(8.75) * n5 / (n * n) * dn * dn - Scalar(2.5) * n5 / n * ddn;
    const Scalar ddg = Scalar(3.75) * n5 / n * dn * dn - Scalar(1.5) * n5 * ddn;
    const Vec3<Scalar> turning = r(j) * ddf * r + 2 * df * (v(j) * r + r(j) * v) + 2 * v(j) * n5 * v;
    return kUnitCoupling<Scalar> / 2 * (3 * turning - ddg * Vec3<Scalar>::Unit(j));
}

/// J^T x'' of all columns. In its own function, so that its stack (1 KiB of small matrices) is free when the equations are
/// solved.
template <typename Scalar>
[[gnu::noinline]] Vec6<Scalar> curvature_gradient(const MotionState<Scalar>& state) {
    const Mat3<Scalar> o = geometry::attitude_matrix(state.q_source_sensor);
    const Vec3<Scalar>& w = state.angular_rate_rad_s;
    const Scalar k = field::coupling_strength(kUnitCoupling<Scalar>, state.position_m.norm());
    const Mat3<Scalar> d = field::dipole_factor<Scalar>(state.position_m.normalized());
    Vec6<Scalar> g = Vec6<Scalar>::Zero();
    for (int j = 0; j < 3; ++j) {
        const auto model = field::column_model(kUnitCoupling<Scalar>, state.position_m, o, j);
        // x = O B, O' = -O [w]x, so x'' = O (w x (w x B - 2 B') + B''). Terms of the accelerations are added below.
        const Vec3<Scalar> b = k * d.col(j);
        const Vec3<Scalar> db = o.transpose() * (model.by_position_per_m * state.velocity_m_s);
        const Vec3<Scalar> inner = w.cross(b) - 2 * db;
        const Vec3<Scalar> turned = w.cross(inner) + field_curvature(state.position_m, state.velocity_m_s, j);
        const Vec3<Scalar> curvature = o * turned + model.by_position_per_m * state.acceleration_m_s2 +
                                       model.by_rotation_per_rad * state.angular_acceleration_rad_s2;
        g.template head<3>() += model.by_position_per_m.transpose() * curvature;
        g.template tail<3>() += model.by_rotation_per_rad.transpose() * curvature;
    }
    return g;
}

}  // namespace

template <typename Scalar>
PoseError<Scalar> matrix_error(const MotionState<Scalar>& state, const Mat3<Scalar>& missing) {
    const Mat3<Scalar> o = geometry::attitude_matrix(state.q_source_sensor);
    Vec6<Scalar> g = Vec6<Scalar>::Zero();
    for (int j = 0; j < 3; ++j) {
        const auto model = field::column_model(kUnitCoupling<Scalar>, state.position_m, o, j);
        g.template head<3>() += model.by_position_per_m.transpose() * missing.col(j);
        g.template tail<3>() += model.by_rotation_per_rad.transpose() * missing.col(j);
    }
    return solve_normal_equations(state.position_m, g);
}

template <typename Scalar>
PoseError<Scalar> skew_error(const MotionState<Scalar>& state, const Vec3<Scalar>& column_age_s) {
    const Mat3<Scalar> o = geometry::attitude_matrix(state.q_source_sensor);
    Mat3<Scalar> missing;
    for (int j = 0; j < 3; ++j) {
        const auto model = field::column_model(kUnitCoupling<Scalar>, state.position_m, o, j);
        missing.col(j) = column_age_s(j) *
                         (model.by_position_per_m * state.velocity_m_s + model.by_rotation_per_rad * state.angular_rate_rad_s);
    }
    return matrix_error(state, missing);
}

template <typename Scalar>
PoseError<Scalar> blur_error(const MotionState<Scalar>& state, Scalar window_s) {
    return solve_normal_equations<Scalar>(state.position_m, -window_s * window_s / 24 * curvature_gradient(state));
}

template PoseError<float> matrix_error(const MotionState<float>&, const Mat3<float>&);
template PoseError<float> skew_error(const MotionState<float>&, const Vec3<float>&);
template PoseError<float> blur_error(const MotionState<float>&, float);
#if TRICOIL_SCALARS & 2  // double
template PoseError<double> matrix_error(const MotionState<double>&, const Mat3<double>&);
template PoseError<double> skew_error(const MotionState<double>&, const Vec3<double>&);
template PoseError<double> blur_error(const MotionState<double>&, double);
#endif

}  // namespace tricoil::error_model

#include <algorithm>
#include <cmath>

#include "core/base/precision.hpp"
#include "core/selfcheck/checks.hpp"
#include "core/selfcheck/known_answer.hpp"
#include "core/selfcheck/sample_pose.hpp"
#include "core/solver/direct.hpp"
#include "core/solver/pose_covariance.hpp"
#include "core/solver/previous_measurement.hpp"

namespace tricoil::selfcheck {
namespace {

/// sample_signal_matrix() plus a matrix that no dipole explains, so that all three singular values matter: 0.05, -0.02, 0.03;
/// 0.01, 0.04, -0.06; -0.03, 0.02, 0.05.
Mat3<double> distorted_matrix() {
    return known<3, 3>(0.47410047266016498, 1.1641703592648558, -1.7525025788707596, -0.61243858725698697, -2.028320641486693,
                       -0.38229000124477081, -2.3606991757229598, -0.70263112207528812, 0.57015327219589769);
}

template <typename Scalar>
double direct_pose() {
    const auto s = solver::solve_direct<Scalar>(distorted_matrix().cast<Scalar>(), Scalar(kSampleCoupling));
    if (!s.ok() || !s->right_handed) {
        return kInfinite;
    }
    const Vec3<Scalar> u = s->direction.x() < 0 ? Vec3<Scalar>(-s->direction) : s->direction;  // both signs are correct
    const Matrix<Scalar, 2, 1> sizes(s->strength, s->range_m);
    return std::max({worst_difference(sizes, known<2, 1>(3.2325530409356742, 0.60050615080811642)),
                     worst_difference(u, known<3, 1>(0.67816732174962757, 0.64822156656444474, -0.34626273890165216)),
                     worst_difference(s->attitude, known<3, 3>(0.78395344690157154, 0.27872946351946154, 0.55473135773750759,
                                                               -0.61875036901765801, 0.27790426949166891, 0.73479058094045691,
                                                               0.05064557168852285, -0.91928184098482857, 0.39032796838541717))});
}

template <typename Scalar>
double direct_misfit() {
    const auto s = solver::solve_direct<Scalar>(distorted_matrix().cast<Scalar>(), Scalar(kSampleCoupling));
    return s.ok() ? std::abs(static_cast<double>(s->misfit_squared) - 0.004207567479979215) : kInfinite;
}

/// Number of wrong answers to inputs that must be refused or flagged.
template <typename Scalar>
int direct_refusals() {
    const Mat3<Scalar> x = sample_signal_matrix().cast<Scalar>();
    const auto solve = [](const Mat3<Scalar>& m) { return solver::solve_direct<Scalar>(m, Scalar(kSampleCoupling)); };
    Mat3<Scalar> broken = x;
    broken(1, 2) = std::numeric_limits<Scalar>::quiet_NaN();
    Mat3<Scalar> dead = x;
    dead.row(1).setZero();
    const auto mirrored = solve(-x);
    int wrong = solve(broken).status().code() == StatusCode::not_finite ? 0 : 1;
    wrong += solve(Mat3<Scalar>::Zero()).status().code() == StatusCode::degenerate ? 0 : 1;
    wrong += solve(dead).status().code() == StatusCode::degenerate ? 0 : 1;
    wrong += mirrored.ok() && !mirrored->right_handed ? 0 : 1;
    return wrong;
}

/// Cramer-Rao bound at the sample pose for noise of 0.001, times weights; relative to its largest entry.
template <typename Scalar>
double covariance() {
    const auto pose = sample_pose<Scalar>();
    const Scalar range = pose.position.range_m;
    const Vec3<Scalar> u = geometry::direction(pose.position.azimuth_rad, pose.position.elevation_rad);
    const Mat6<Scalar> c =
        solver::pose_covariance<Scalar>(Scalar(kSampleCoupling) / (range * range * range), range, u, Scalar(1e-3));
    const auto answer = known<6, 1>(-6.8415560164675514e-09, -2.6170015727228687e-08, -6.3673852744032627e-08,
                                    -1.9565544646920119e-07, 1.4127305111667111e-07, -2.4934401841899361e-08);
    return worst_difference(c * sample_weights().cast<Scalar>(), answer) / 2e-7;
}

template <typename Scalar>
double increments() {
    const auto w =
        known<3, 3>(3.219633516459719, 0.22017974997646017, -0.22125561567328611, 0.2238931591364472, -1.6084509740398305,
                    0.064799171329569361, -0.23674348170498988, -0.085840784967050332, -1.6078774646320229);
    const auto step = solver::tracking_increments<Scalar>(w.cast<Scalar>(), Scalar(kSampleCoupling));
    if (!step.ok()) {
        return kInfinite;
    }
    Matrix<Scalar, 7, 1> values;
    values << step->range_m, step->position_azimuth, step->position_elevation, step->rotation, step->mean_roll;
    return worst_difference(values,
                            known<7, 1>(0.60130830211747011, 0.044822149210426834, 0.0426068678499456, -0.05332332672535979,
                                        -0.0096208875653239507, -0.0023067278564488647, -0.046787920279281379));
}

/// Estimate before the step: wrong by about 3 degrees in every angle.
template <typename Scalar>
solver::AnglePose<Scalar> estimate_before() {
    return {{Scalar(0.6), Scalar(0.75), Scalar(0.31)}, {Scalar(0.36), Scalar(-0.57), Scalar(1.14)}};
}

template <typename Scalar>
solver::VectorPose<Scalar> as_vectors(const solver::AnglePose<Scalar>& pose) {
    return {pose.position.range_m, geometry::direction(pose.position.azimuth_rad, pose.position.elevation_rad),
            geometry::attitude_matrix(pose.attitude)};
}

template <typename Scalar>
double angle_step() {
    const auto next =
        solver::step_angles<Scalar>(sample_signal_matrix().cast<Scalar>(), Scalar(kSampleCoupling), estimate_before<Scalar>());
    if (!next.ok()) {
        return kInfinite;
    }
    const auto& [position, attitude] = *next;
    Vec6<Scalar> values;
    values << position.range_m, position.azimuth_rad, position.elevation_rad, attitude.azimuth_rad, attitude.elevation_rad,
        attitude.roll_rad;
    return worst_difference(values, known<6, 1>(0.60130830211747011, 0.797065598260708, 0.3526068678499456, 0.40224787594130434,
                                                -0.59847255359283369, 1.0877831069517963));
}

template <typename Scalar>
double vector_step() {
    const Mat3<Scalar> x = sample_signal_matrix().cast<Scalar>();
    const auto before = as_vectors(estimate_before<Scalar>());
    const auto next = solver::step_vectors<Scalar>(x, Scalar(kSampleCoupling), before);
    const auto settled = solver::step_vectors<Scalar>(x, Scalar(kSampleCoupling), before, 5);
    if (!next.ok() || !settled.ok()) {
        return kInfinite;
    }
    const auto real = as_vectors(sample_pose<Scalar>());
    return std::max(
        {worst_difference(next->direction, known<3, 1>(0.65549692883804056, 0.671800297504201, -0.34497555936205621)),
         worst_difference(next->attitude, known<3, 3>(0.76335230434427015, 0.32056522539931009, 0.56083080845918432,
                                                      -0.63714565808756851, 0.23051694426472327, 0.7354640363654863,
                                                      0.10648319037506306, -0.91874908145344225, 0.38021238209190944)),
         std::abs(static_cast<double>(next->range_m) - 0.60130830211747011), worst_difference(settled->direction, real.direction),
         worst_difference(settled->attitude, real.attitude)});
}

template <typename Scalar>
int step_refusals() {
    const Mat3<Scalar> x = sample_signal_matrix().cast<Scalar>();
    const auto c = Scalar(kSampleCoupling);
    auto sideways = sample_pose<Scalar>();
    sideways.position.elevation_rad += Scalar(1.1);  // beyond 54.7 degrees
    auto lost = estimate_before<Scalar>();
    lost.attitude.roll_rad = std::numeric_limits<Scalar>::quiet_NaN();
    int wrong = solver::step_angles<Scalar>(x, c, sideways).status().code() == StatusCode::not_converged ? 0 : 1;
    wrong += solver::step_vectors<Scalar>(x, c, as_vectors(sideways)).status().code() == StatusCode::not_converged ? 0 : 1;
    wrong += solver::step_angles<Scalar>(x, c, lost).ok() ? 1 : 0;
    // W with NaN or infinity although W11 is finite; and increments that make the angles infinite, as at a pole.
    Mat3<Scalar> w = x;
    w(0, 0) = 1;
    w(1, 2) = std::numeric_limits<Scalar>::quiet_NaN();
    wrong += solver::tracking_increments<Scalar>(w, c).status().code() == StatusCode::not_finite ? 0 : 1;
    solver::TrackingIncrements<Scalar> endless{1, std::numeric_limits<Scalar>::infinity(), 0, Vec3<Scalar>::Zero(), 0};
    const auto beyond = solver::add_increments<Scalar>(sample_pose<Scalar>(), endless);
    wrong += beyond.status().code() == StatusCode::not_converged ? 0 : 1;
    return wrong;
}

}  // namespace

template <typename Scalar>
void check_direct(Report& report) {
    constexpr Precision p = precision_of<Scalar>();
    report.add(CheckId::direct_pose, p, "direct solution", direct_pose<Scalar>(), roundings<Scalar>(64));
}

template <typename Scalar>
void check_solver(Report& report) {
    constexpr Precision p = precision_of<Scalar>();
    check_direct<Scalar>(report);
    report.add(CheckId::direct_misfit, p, "misfit", direct_misfit<Scalar>(), roundings<Scalar>(64));
    report.add(CheckId::direct_refusals, p, "direct solution: bad inputs accepted", direct_refusals<Scalar>(), 0);
    report.add(CheckId::covariance, p, "covariance (relative)", covariance<Scalar>(), roundings<Scalar>(64));
    report.add(CheckId::tracking_increments, p, "increments (15), (16)", increments<Scalar>(), roundings<Scalar>(16));
    report.add(CheckId::step_angles, p, "step, angle form", angle_step<Scalar>(), roundings<Scalar>(32));
    report.add(CheckId::step_vectors, p, "step, pole-free form", vector_step<Scalar>(), roundings<Scalar>(32));
    report.add(CheckId::step_refusals, p, "step: bad inputs accepted", step_refusals<Scalar>(), 0);
}

template void check_direct<float>(Report&);
template void check_solver<float>(Report&);
#if TRICOIL_SCALARS & 2  // double
template void check_direct<double>(Report&);
template void check_solver<double>(Report&);
#endif

}  // namespace tricoil::selfcheck

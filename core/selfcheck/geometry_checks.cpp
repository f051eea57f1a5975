#include <numbers>

#include "core/geometry/angles.hpp"
#include "core/geometry/rotations.hpp"
#include "core/selfcheck/checks.hpp"
#include "core/selfcheck/known_answer.hpp"

namespace tricoil::selfcheck {
namespace {

/// Table 1 at 0.5 rad.
template <typename Scalar>
double rotations() {
    constexpr double c = 0.87758256189037254;
    constexpr double s = 0.47942553860420295;
    const auto angle = Scalar(0.5);
    const double x = worst_difference(geometry::rotation_x(angle), known<3, 3>(1., 0., 0., 0., c, s, 0., -s, c));
    const double y = worst_difference(geometry::rotation_y(angle), known<3, 3>(c, 0., -s, 0., 1., 0., s, 0., c));
    const double z = worst_difference(geometry::rotation_z(angle), known<3, 3>(c, s, 0., -s, c, 0., 0., 0., 1.));
    return std::max({x, y, z});
}

template <typename Scalar>
double line_of_sight() {
    const auto answer = known<3, 3>(0.65446727161841711, 0.6738647371858757, -0.34289780745545134, -0.7173560908995229,
                                    0.6967067093471655, 0., 0.23889920307464546, 0.24597983073425986, 0.93937271284737878);
    const auto a = Scalar(0.8);
    const auto b = Scalar(0.35);
    return std::max(worst_difference(geometry::line_of_sight_rotation(a, b), answer),
                    worst_difference(geometry::direction(a, b), answer.row(0).transpose()));
}

template <typename Scalar>
double spherical() {
    const auto answer = known<3, 1>(0.85080745310394224, 0.87602415834163838, -0.44576714969208675);
    const Vec3<Scalar> p = geometry::to_cartesian(geometry::Spherical<Scalar>{Scalar(1.3), Scalar(0.8), Scalar(0.35)});
    const auto back = geometry::to_spherical<Scalar>(answer.cast<Scalar>());
    const Vec3<Scalar> angles(back.range_m, back.azimuth_rad, back.elevation_rad);
    return std::max(worst_difference(p, answer), worst_difference(angles, known<3, 1>(1.3, 0.8, 0.35)));
}

/// Attitudes away from the poles, close to a pole, and at a pole, where roll is zero by definition.
template <typename Scalar>
double attitude() {
    const auto answer =
        known<3, 3>(0.7601844418546907, 0.3214008270064177, 0.56464247339503526, -0.64012900206417167, 0.2218291165388519,
                    0.7355451745283359, 0.11115068636045414, -0.92059402097514353, 0.37436903379742398);
    const auto o = geometry::attitude_matrix(geometry::Euler<Scalar>{Scalar(0.4), Scalar(-0.6), Scalar(1.1)});
    const auto back = geometry::to_euler<Scalar>(answer.cast<Scalar>());
    const Vec3<Scalar> angles(back.azimuth_rad, back.elevation_rad, back.roll_rad);
    const auto pole = geometry::to_euler<Scalar>(known<3, 3>(0., 0., -1., -0.6, 0.8, 0., 0.8, 0.6, 0.).cast<Scalar>());
    const Vec3<Scalar> pole_angles(pole.azimuth_rad, pole.elevation_rad, pole.roll_rad);
    const geometry::Euler<Scalar> near{Scalar(0.4), Scalar(std::numbers::pi / 2 - 0.01), Scalar(1.1)};
    const auto near_back = geometry::to_euler<Scalar>(geometry::attitude_matrix(near));
    const Vec3<Scalar> near_angles(near_back.azimuth_rad, near_back.elevation_rad, near_back.roll_rad);
    // Division by the cosine amplifies rounding errors a hundredfold.
    const double near_pole = worst_difference(near_angles, known<3, 1>(0.4, std::numbers::pi / 2 - 0.01, 1.1)) / 100;
    return std::max({near_pole, worst_difference(o, answer), worst_difference(angles, known<3, 1>(0.4, -0.6, 1.1)),
                     worst_difference(pole_angles, known<3, 1>(0.64350110879328437, std::numbers::pi / 2, 0.))});
}

template <typename Scalar>
Matrix<Scalar, 4, 1> wxyz(const Quat<Scalar>& q) {
    return {q.w(), q.x(), q.y(), q.z()};
}

template <typename Scalar>
double quaternion() {
    const auto answer = known<4, 1>(0.76752566605146277, 0.53944098183175115, -0.14771225481213238, 0.31319142525134741);
    const auto o = geometry::attitude_matrix(geometry::Euler<Scalar>{Scalar(0.4), Scalar(-0.6), Scalar(1.1)});
    const auto q = geometry::attitude_quaternion(o);
    return std::max(worst_difference(wxyz(q), answer), worst_difference(geometry::attitude_matrix(q), o));
}

/// Error of angle_between() for two attitudes, and for one quaternion negated (the same rotation).
template <typename Scalar>
double angle_between() {
    const Quat<Scalar> a(Scalar(0.5), Scalar(0.5), Scalar(-0.5), Scalar(0.5));
    const Quat<Scalar> b(Scalar(0.2), Scalar(0.4), Scalar(0.4), Scalar(0.8));
    const Quat<Scalar> minus_b(-b.w(), -b.x(), -b.y(), -b.z());
    constexpr double kAnswer = 2.0943951023931953;  // a . b = 0.5: 2 acos(0.5)
    const auto off = [&](const Quat<Scalar>& to) {
        return std::abs(static_cast<double>(geometry::angle_between(a, to)) - kAnswer);
    };
    return std::max(off(b), off(minus_b));
}

template <typename Scalar>
double small_rotation() {
    const auto vector = known<3, 1>(0.2, -0.1, 0.3);
    const auto answer = known<4, 1>(0.98255098215525905, 0.099417686649718978, -0.049708843324859489, 0.14912652997457845);
    const auto q = geometry::rotation_vector_to_quaternion<Scalar>(vector.cast<Scalar>());
    const auto tiny = geometry::rotation_vector_to_quaternion<Scalar>({Scalar(1e-5), 0, 0});
    const Quat<Scalar> tiny_turn(1, 0, Scalar(5e-8), 0);
    // Small, but large enough that sine and angle differ. Answer: sine and cosine of the half angle.
    const Quat<Scalar> small_turn(Scalar(0.99999687500162762), Scalar(0), Scalar(0), Scalar(0.0024999973958341471));
    const auto back = geometry::quaternion_to_rotation_vector<Scalar>(q);
    const Quat<Scalar> opposite(-q.w(), -q.x(), -q.y(), -q.z());  // the same rotation
    const Vec3<Scalar> cross = geometry::skew<Scalar>(vector.cast<Scalar>()) * Vec3<Scalar>(1, 2, 4);
    return std::max({worst_difference(wxyz(q), answer), worst_difference(back, vector),
                     worst_difference(geometry::quaternion_to_rotation_vector<Scalar>(opposite), vector),
                     worst_difference(cross, known<3, 1>(-1., -0.5, 0.5)),
                     1e5 * std::abs(static_cast<double>(tiny.x()) - 4.9999999999791667e-06),
                     1e2 * std::abs(static_cast<double>(geometry::quaternion_to_rotation_vector(small_turn).z()) - 5e-3),
                     1e7 * std::abs(static_cast<double>(geometry::quaternion_to_rotation_vector(tiny_turn).y()) - 1e-7)});
}

/// Orthonormal and right-handed, also along the coordinate axes and their opposites.
template <typename Scalar>
double transverse_axes() {
    const double s = 0.57735026918962576;
    const Matrix<double, 3, 7> directions =
        known<3, 7>(1., 0., 0., 0., 0., s, 0.8, 0., 1., 0., 0., -1., s, 0., 0., 0., 1., -1., 0., s, -0.6);
    double worst = 0;
    for (int n = 0; n < 7; ++n) {
        const Vec3<Scalar> x = directions.col(n).cast<Scalar>();
        const auto axes = geometry::transverse_axes(x);
        Mat3<Scalar> triad;
        triad << x, axes;
        worst = std::max({worst, worst_difference(triad.transpose() * triad, Mat3<double>::Identity()),
                          worst_difference(x.cross(axes.col(0)), axes.col(1))});
    }
    return worst;
}

template <typename Scalar>
double whole_turns() {
    const auto off = [](double angle, double answer) {
        return std::abs(static_cast<double>(geometry::wrap_turns(static_cast<Scalar>(angle))) - answer);
    };
    return std::max(off(7, 0.71681469282041377), off(4, -2.2831853071795862));  // 4 distinguishes whole turns from half turns
}

}  // namespace

template <typename Scalar>
void check_geometry(Report& report) {
    constexpr Precision p = precision_of<Scalar>();
    const double limit = roundings<Scalar>(8);
    report.add(CheckId::rotations, p, "rotations of Table 1", rotations<Scalar>(), limit);
    report.add(CheckId::line_of_sight, p, "line of sight", line_of_sight<Scalar>(), limit);
    report.add(CheckId::spherical, p, "spherical coordinates", spherical<Scalar>(), limit);
    report.add(CheckId::attitude, p, "Euler angles", attitude<Scalar>(), limit);
    report.add(CheckId::quaternion, p, "quaternion", std::max(quaternion<Scalar>(), angle_between<Scalar>()), limit);
    report.add(CheckId::small_rotation, p, "small rotations", small_rotation<Scalar>(), limit);
    report.add(CheckId::transverse_axes, p, "transverse axes", transverse_axes<Scalar>(), limit);
    report.add(CheckId::whole_turns, p, "whole turns (rad)", whole_turns<Scalar>(), limit);
}

template void check_geometry<float>(Report&);
template void check_geometry<double>(Report&);

}  // namespace tricoil::selfcheck

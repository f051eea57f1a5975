#include <gtest/gtest.h>

#include <array>
#include <numbers>

#include "core/geometry/angles.hpp"
#include "core/linear/eigen.hpp"
#include "tests/support/approx.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::geometry {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(Rotations, FollowTable1) {
    // Passive: in a frame turned by 90 degrees about z, the source's x axis points along -y.
    EXPECT_TRUE(is_approx((rotation_z(kPi / 2) * Vec3<double>::UnitX()), -Vec3<double>::UnitY(), 1e-15));
    EXPECT_TRUE(is_approx((rotation_y(kPi / 2) * Vec3<double>::UnitX()), Vec3<double>::UnitZ(), 1e-15));
    EXPECT_TRUE(is_approx((rotation_x(kPi / 2) * Vec3<double>::UnitY()), -Vec3<double>::UnitZ(), 1e-15));
}

TEST(Spherical, PositiveElevationPointsDown) {
    const Vec3<double> p = to_cartesian(Spherical<double>{2, 0, kPi / 6});
    EXPECT_NEAR(p.x(), std::sqrt(3.0), 1e-15);
    EXPECT_NEAR(p.z(), -1, 1e-15);
}

TEST(Spherical, DirectionIsTheFirstRowOfP) {
    const Mat3<double> p = line_of_sight_rotation(0.7, -0.4);
    EXPECT_TRUE(is_approx(p.row(0).transpose(), direction(0.7, -0.4), 1e-15));
}

TEST(Spherical, RoundTripInAllOctantsAndAtThePoles) {
    test::RandomPoses random(1);
    for (int i = 0; i < 1000; ++i) {
        const Vec3<double> p = random.uniform(0.1, 2) * random.direction();
        EXPECT_TRUE(is_approx(to_cartesian(to_spherical(p)), p, 1e-14));
    }
    for (const double z : {-1.0, 1.0}) {
        const Spherical<double> s = to_spherical(Vec3<double>(0, 0, z));
        EXPECT_DOUBLE_EQ(s.elevation_rad, -z * kPi / 2);
        EXPECT_TRUE(is_approx(to_cartesian(s), Vec3<double>(0, 0, z), 1e-15));
    }
}

TEST(Euler, RoundTripsThroughMatrixAndQuaternion) {
    test::RandomPoses random(2);
    for (int i = 0; i < 1000; ++i) {
        const Mat3<double> o = attitude_matrix(random.attitude());
        EXPECT_TRUE(is_approx(attitude_matrix(to_euler(o)), o, 1e-13));
        EXPECT_TRUE(is_approx(attitude_matrix(attitude_quaternion(o)), o, 1e-13));
    }
}

TEST(Euler, MatrixIsKeptAtTheGimbalPole) {
    for (const double theta : {-kPi / 2, kPi / 2}) {
        const Mat3<double> o = attitude_matrix(Euler<double>{0.3, theta, -0.8});
        const Euler<double> e = to_euler(o);
        EXPECT_NEAR(e.elevation_rad, theta, 1e-7);
        EXPECT_TRUE(is_approx(attitude_matrix(e), o, 1e-7));
    }
}

TEST(SmallRotations, ExponentialAndLogarithmAreInverseAtAllSizes) {
    const Vec3<double> axis = Vec3<double>(1, -2, 0.5).normalized();
    for (const double angle : {0.0, 1e-12, 1e-5, 2e-4, 1.0, kPi - 1e-6}) {
        const Vec3<double> r = angle * axis;
        const Quat<double> q = rotation_vector_to_quaternion(r);
        EXPECT_NEAR(q.norm(), 1, 1e-12) << angle;
        EXPECT_TRUE((quaternion_to_rotation_vector(q) - r).norm() < 1e-12) << angle;
        const Mat3<double> exact = Eigen::AngleAxisd(angle, eigen(axis)).toRotationMatrix();
        EXPECT_TRUE(is_approx(q.toRotationMatrix(), exact, 1e-12)) << angle;
    }
}

TEST(TransverseAxes, CompleteARightHandedTriadEverywhere) {
    test::RandomPoses random(3);
    for (int i = 0; i < 1000; ++i) {
        const Vec3<double> x = i == 0 ? Vec3<double>(0, 0, -1) : i == 1 ? Vec3<double>(0, 0, 1) : random.direction();
        Mat3<double> triad;
        triad << x, transverse_axes(x);
        EXPECT_TRUE((triad.transpose() * triad).isIdentity(1e-14));
        EXPECT_NEAR(triad.determinant(), 1, 1e-14);
    }
}

TEST(WrapTurns, RemovesWholeTurnsOnly) {
    EXPECT_NEAR(wrap_turns(5 * kPi + 0.25), -kPi + 0.25, 1e-12);
    EXPECT_DOUBLE_EQ(wrap_turns(0.25), 0.25);
}

}  // namespace
}  // namespace tricoil::geometry

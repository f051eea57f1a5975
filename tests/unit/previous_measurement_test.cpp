#include "core/solver/previous_measurement.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/approx.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::solver {
namespace {

constexpr double kPi = std::numbers::pi;

Mat3<double> signal(const AnglePose<double>& pose) {
    return field::signal_matrix<double>(1.0, geometry::to_cartesian(pose.position), geometry::attitude_matrix(pose.attitude));
}

AnglePose<double> moved(AnglePose<double> pose, double by) {
    pose.position.azimuth_rad += by;
    pose.position.elevation_rad -= by;
    pose.attitude.azimuth_rad += 2 * by;
    pose.attitude.elevation_rad += by;
    pose.attitude.roll_rad -= by;
    return pose;
}

double distance(const AnglePose<double>& a, const AnglePose<double>& b) {
    return (geometry::to_cartesian(a.position) - geometry::to_cartesian(b.position)).norm() +
           (geometry::attitude_matrix(a.attitude) - geometry::attitude_matrix(b.attitude)).norm();
}

TEST(TrackingIncrements, InvertEquation14) {
    // R that satisfies (14) exactly.
    const double a = 1e-3;
    const double b = -2e-3;
    const double psi = 0.5e-3;
    const double theta = 1.5e-3;
    const double phi = -0.7e-3;
    Mat3<double> w;
    w << 1, 1.5 * a - 0.5 * psi, -1.5 * b + 0.5 * theta, 1.5 * a - psi, -0.5, -0.5 * phi, -1.5 * b + theta, 0.5 * phi, -0.5;
    const auto step = tracking_increments<double>(8 * w, 1.0);
    ASSERT_TRUE(step.ok());
    EXPECT_NEAR(step->range_m, 0.5, 1e-15);
    EXPECT_NEAR(step->position_azimuth, a, 1e-15);
    EXPECT_NEAR(step->position_elevation, b, 1e-15);
    EXPECT_TRUE(is_approx(step->rotation, Vec3<double>(phi, theta, psi), 1e-12));
}

TEST(StepAngles, TruthIsAFixedPoint) {
    const AnglePose<double> pose{{0.6, 0.8, -0.4}, {0.3, 0.5, -1.2}};
    const auto next = step_angles<double>(signal(pose), 1.0, pose);
    ASSERT_TRUE(next.ok());
    EXPECT_LT(distance(*next, pose), 1e-14);
}

TEST(StepAngles, ErrorFallsWithTheSquareOfTheStepAndWithEveryPass) {
    const AnglePose<double> truth{{0.6, 0.8, -0.4}, {0.3, 0.5, -1.2}};
    const auto error = [&](double moved_by, int passes) {
        return distance(*step_angles<double>(signal(truth), 1.0, moved(truth, moved_by), passes), truth);
    };
    EXPECT_NEAR(error(0.02, 1) / error(0.01, 1), 4, 0.5);
    EXPECT_LT(error(0.02, 2), error(0.02, 1) / 100);
    EXPECT_LT(error(0.02, 3), error(0.02, 2) / 100);
}

TEST(StepAngles, RefusesAPoseThatIsNotFinite) {
    AnglePose<double> broken{{0.6, 0.8, 0}, {}};
    const Mat3<double> x = signal({{0.6, 0.8, kPi / 2 - 0.01}, {0, 0, 0.01}});
    broken.position.elevation_rad = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(step_angles<double>(x, 1.0, broken).status().code(), StatusCode::not_finite);
}

TEST(StepVectors, AgreesWithTheAngleFormToFirstOrder) {
    const AnglePose<double> truth{{0.6, 0.8, -0.4}, {0.3, 0.5, -1.2}};
    const AnglePose<double> before = moved(truth, 1e-3);
    const auto angles = step_angles<double>(signal(truth), 1.0, before);
    const VectorPose<double> start{before.position.range_m,
                                   geometry::direction(before.position.azimuth_rad, before.position.elevation_rad),
                                   geometry::attitude_matrix(before.attitude)};
    const auto vectors = step_vectors<double>(signal(truth), 1.0, start);
    EXPECT_LT((vectors->range_m * vectors->direction - geometry::to_cartesian(angles->position)).norm(), 1e-5);
    EXPECT_LT((vectors->attitude - geometry::attitude_matrix(angles->attitude)).norm(), 1e-5);
}

TEST(StepVectors, ConvergesEverywhereAlsoOnThePoles) {
    test::RandomPoses random(10);
    for (int i = 0; i < 2000; ++i) {
        const Vec3<double> u = i == 0 ? Vec3<double>(0, 0, 1) : i == 1 ? Vec3<double>(0, 0, -1) : random.direction();
        const Quat<double> q =
            i < 4 ? geometry::attitude_quaternion(geometry::attitude_matrix(geometry::Euler<double>{0.1, kPi / 2, 0}))
                  : random.attitude();
        const Mat3<double> o = geometry::attitude_matrix(q);
        const Vec3<double> r = 0.1 * random.direction();
        const VectorPose<double> start{0.45, (u + 0.05 * random.direction()).normalized(),
                                       o * geometry::rotation_vector_to_quaternion<double>(r).toRotationMatrix()};
        const auto solved = step_vectors<double>(test::unit_signal(0.5 * u, q), 1.0, start, 4);
        ASSERT_TRUE(solved.ok());
        EXPECT_LT((solved->range_m * solved->direction - 0.5 * u).norm(), 1e-10);
        EXPECT_LT((solved->attitude - o).norm(), 1e-9);
    }
}

TEST(StepVectors, RefusesAPreviousPoseTooFarOff) {
    const Mat3<double> x = test::unit_signal({0.5, 0, 0}, Quat<double>::Identity());
    const VectorPose<double> far_off{0.5, Vec3<double>::UnitY(), Mat3<double>::Identity()};
    EXPECT_EQ(step_vectors<double>(x, 1.0, far_off).status().code(), StatusCode::not_converged);
    Mat3<double> nan = x;
    nan(0, 0) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(step_vectors<double>(nan, 1.0, {}).status().code(), StatusCode::not_finite);
}

}  // namespace
}  // namespace tricoil::solver

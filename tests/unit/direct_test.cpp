#include "core/solver/direct.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "core/linear/eigen.hpp"
#include "core/solver/pose_covariance.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::solver {
namespace {

/// Position and rotation error; the hemisphere is assumed known.
struct Error {
    double position_m;
    double attitude;
};

template <typename Scalar>
Error solve_error(const Vec3<double>& p, const Quat<double>& q) {
    const Mat3<double> o = geometry::attitude_matrix(q);
    const Mat3<Scalar> x = field::signal_matrix<double>(1.0, p, o).template cast<Scalar>();
    const auto solution = solve_direct<Scalar>(x, Scalar(1));
    EXPECT_TRUE(solution.ok());
    const Vec3<double> u = solution->direction.template cast<double>();
    const double sign = u.dot(p) < 0 ? -1 : 1;
    return {(sign * static_cast<double>(solution->range_m) * u - p).norm(),
            (solution->attitude.template cast<double>() - o).norm()};
}

TEST(Direct, ExactOnDipolesInBothPrecisions) {
    test::RandomPoses random(6);
    for (int i = 0; i < 5000; ++i) {
        const Vec3<double> p = random.uniform(0.15, 1.2) * random.direction();
        const Quat<double> q = random.attitude();
        const Error exact = solve_error<double>(p, q);
        EXPECT_LT(exact.position_m, 1e-13);
        EXPECT_LT(exact.attitude, 1e-13);
        const Error single = solve_error<float>(p, q);
        EXPECT_LT(single.position_m, 1e-5 * p.norm());
        EXPECT_LT(single.attitude, 1e-5);
    }
}

TEST(Direct, ExactAtPolesOnAxesAndInAllOctants) {
    test::RandomPoses random(7);
    for (int octant = 0; octant < 8; ++octant) {
        const Vec3<double> p((octant & 1) != 0 ? 0.4 : -0.4, (octant & 2) != 0 ? 0.3 : -0.3, (octant & 4) != 0 ? 0.2 : -0.2);
        EXPECT_LT(solve_error<double>(p, random.attitude()).position_m, 1e-13);
        EXPECT_LT(solve_error<float>(p, random.attitude()).position_m, 1e-5 * p.norm());
    }
    for (int axis = 0; axis < 3; ++axis) {
        for (const double side : {-0.5, 0.5}) {
            for (const double theta : {-1.5707963267948966, 0.0, 1.5707963267948966}) {
                const Quat<double> q =
                    geometry::attitude_quaternion(geometry::attitude_matrix(geometry::Euler<double>{0.3, theta, 0}));
                EXPECT_LT(solve_error<double>(side * Vec3<double>::Unit(axis), q).position_m, 1e-13);
                EXPECT_LT(solve_error<float>(side * Vec3<double>::Unit(axis), q).attitude, 1e-5);
            }
        }
    }
}

TEST(Direct, MisfitIsTheDistanceToTheNearestDipole) {
    test::RandomPoses random(8);
    for (int i = 0; i < 200; ++i) {
        const Mat3<double> x = test::unit_signal(0.5 * random.direction(), random.attitude()) + 0.3 * random.gaussian_matrix();
        const auto s = solve_direct<double>(x, 1.0);
        const Mat3<double> model = s->strength * s->attitude * field::dipole_factor<double>(s->direction);
        EXPECT_NEAR(s->misfit_squared, (x - model).squaredNorm(), 1e-9);
        EXPECT_TRUE((s->attitude.transpose() * s->attitude).isIdentity(1e-12));
    }
}

TEST(Direct, DetectsWrongHandedWiring) {
    const Mat3<double> x = test::unit_signal({0.4, 0.1, -0.3}, Quat<double>(0.9, 0.1, -0.3, 0.2).normalized());
    Mat3<double> reversed = x;
    reversed.col(1) *= -1;
    EXPECT_TRUE(solve_direct<double>(x, 1.0)->right_handed);
    EXPECT_FALSE(solve_direct<double>(reversed, 1.0)->right_handed);
}

TEST(Direct, WorksAtAnyScale) {
    const Mat3<double> x = test::unit_signal({0.4, 0.1, -0.3}, Quat<double>::Identity());
    for (const float scale : {1e-30F, 1e-20F, 1.0F, 1e20F, 1e30F}) {
        const Mat3<float> scaled = scale * x.cast<float>();
        const auto s = solve_direct<float>(scaled, scale);
        ASSERT_TRUE(s.ok()) << scale;
        EXPECT_NEAR(static_cast<double>(s->range_m), Vec3<double>(0.4, 0.1, -0.3).norm(), 1e-5) << scale;
    }
}

TEST(Direct, RefusesDegenerateMatrices) {
    const Mat3<double> x = test::unit_signal({0.4, 0.1, -0.3}, Quat<double>::Identity());
    Mat3<double> nan = x;
    nan(1, 2) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(solve_direct<double>(nan, 1.0).status().code(), StatusCode::not_finite);
    nan(1, 2) = std::numeric_limits<double>::infinity();
    EXPECT_EQ(solve_direct<double>(nan, 1.0).status().code(), StatusCode::not_finite);
    EXPECT_EQ(solve_direct<double>(Mat3<double>::Zero(), 1.0).status().code(), StatusCode::degenerate);
    EXPECT_EQ(solve_direct<double>(Mat3<double>::Ones(), 1.0).status().code(), StatusCode::degenerate);
    Mat3<double> dead_coil = x;
    dead_coil.row(1).setZero();
    EXPECT_EQ(solve_direct<double>(dead_coil, 1.0).status().code(), StatusCode::degenerate);
    EXPECT_EQ(solve_direct<float>(dead_coil.cast<float>(), 1.0F).status().code(), StatusCode::degenerate);
}

TEST(PoseCovariance, IsTheInverseInformationOfTheModel) {
    test::RandomPoses random(9);
    for (int i = 0; i < 100; ++i) {
        const double range = random.uniform(0.2, 1.2);
        const Vec3<double> u = random.direction();
        const auto jacobian = field::signal_matrix_jacobian<double>(1.0, range * u, geometry::attitude_matrix(random.attitude()));
        const double sigma = 1e-3;
        const Mat6<double> bound = eigen(jacobian.transpose() * jacobian / (sigma * sigma)).inverse();
        const Mat6<double> closed = pose_covariance<double>(field::coupling_strength(1.0, range), range, u, sigma);
        EXPECT_LT((closed - bound).norm(), 1e-10 * bound.norm());
    }
}

TEST(PoseCovariance, Is1060MicrometresAtHalfAMetreAnd60Decibels) {
    const Mat6<double> c = pose_covariance<double>(1.0, 0.5, Vec3<double>::UnitY(), 1e-3);
    EXPECT_NEAR(std::sqrt(c.topLeftCorner<3, 3>().trace()), 1.06e-3, 0.01e-3);
}

}  // namespace
}  // namespace tricoil::solver

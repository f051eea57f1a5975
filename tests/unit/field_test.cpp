#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <array>
#include <numbers>

#include "core/linear/eigen.hpp"
#include "tests/support/approx.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::field {
namespace {

TEST(ConcentricDipole, EqualsEquation4OnTheLineOfSight) {
    const Mat3<double> x = signal_matrix<double>(1.0, {0.5, 0, 0}, Mat3<double>::Identity());
    EXPECT_TRUE(is_approx(x, 8.0 * Mat3<double>(Vec3<double>(1, -0.5, -0.5).asDiagonal()), 1e-14));
}

TEST(ConcentricDipole, EqualsTheRotationsOfEquation6) {
    const double alpha = 0.9;
    const double beta = -0.35;
    const geometry::Euler<double> attitude{0.4, -1.1, 2.2};
    const Mat3<double> p = geometry::line_of_sight_rotation(alpha, beta);
    const Mat3<double> o = geometry::attitude_matrix(attitude);
    const Mat3<double> s = Vec3<double>(1, -0.5, -0.5).asDiagonal();
    const double range = 0.7;
    const Mat3<double> expected = 2.0 / (range * range * range) * o * p.transpose() * s * p;
    const auto position = geometry::to_cartesian(geometry::Spherical<double>{range, alpha, beta});
    EXPECT_TRUE(is_approx(signal_matrix<double>(2.0, position, o), expected, 1e-14));
}

TEST(ConcentricDipole, SingularValuesAndHandednessOfADipole) {
    test::RandomPoses random(4);
    for (int i = 0; i < 100; ++i) {
        const Mat3<double> x = test::unit_signal(0.5 * random.direction(), random.attitude());
        EXPECT_TRUE(eigen(x).jacobiSvd().singularValues().isApprox(eigen(Vec3<double>(8, 4, 4)), 1e-12));
        EXPECT_GT(x.determinant(), 0);
    }
}

/// Fourth-order central differences: independent of the analytic derivation.
Matrix<double, 9, 6> numeric_jacobian(const Vec3<double>& p, const Quat<double>& q) {
    constexpr double kStep = 1e-3;
    const auto at = [&](const Vec6<double>& d) -> Matrix<double, 9, 1> {
        const Quat<double> turned = geometry::rotation_vector_to_quaternion<double>(d.tail<3>()) * q;
        return test::unit_signal(p + d.head<3>(), turned).reshaped();
    };
    Matrix<double, 9, 6> jacobian;
    for (int i = 0; i < 6; ++i) {
        const Vec6<double> d = kStep * Vec6<double>::Unit(i);
        jacobian.col(i) = (8 * (at(d) - at(-d)) - (at(2 * d) - at(-2 * d))) / (12 * kStep);
    }
    return jacobian;
}

TEST(ConcentricDipole, JacobianMatchesNumericDifferentiationAlsoAtPoles) {
    test::RandomPoses random(5);
    const double quarter = std::numbers::pi / 2;
    for (int i = 0; i < 200; ++i) {
        Vec3<double> p = random.uniform(0.4, 1.0) * random.direction();
        Quat<double> q = random.attitude();
        if (i < 4) {
            p = Vec3<double>(0, 0, i % 2 == 0 ? 0.6 : -0.6);
            q = geometry::attitude_quaternion(
                geometry::attitude_matrix(geometry::Euler<double>{0.2, i < 2 ? quarter : -quarter, 0.5}));
        }
        const auto analytic = signal_matrix_jacobian<double>(1.0, p, geometry::attitude_matrix(q));
        EXPECT_LT((analytic - numeric_jacobian(p, q)).norm(), 1e-7 * analytic.norm()) << "pose " << i;
    }
}

}  // namespace
}  // namespace tricoil::field

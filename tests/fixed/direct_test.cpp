#include "core/fixed/direct.hpp"

#include <gtest/gtest.h>

#include "core/solver/direct.hpp"
#include "tests/fixed/converter.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::fixed {
namespace {

struct Difference {
    double position_m;
    double attitude_rad;
    double misfit_share;
};

/// Difference from the double-precision solution of the same codes: error of the arithmetic alone.
Difference difference_to_double(const BlockMatrix& codes, double c) {
    const auto exact = solver::solve_direct<double>(as_double(codes), c);
    const auto ours = solve_direct(codes, scaled_from(c));
    EXPECT_TRUE(exact.ok() && ours.ok());
    Vec3<double> u = to_double(ours->direction);
    if (u.dot(exact->direction) < 0) {
        u = -u;
    }
    EXPECT_NEAR(u.norm(), 1, 1e-8);
    EXPECT_EQ(ours->right_handed, exact->right_handed);
    const Mat3<double> turn = to_double(ours->attitude) * exact->attitude.transpose();
    const double share = exact->misfit_squared / as_double(codes).squaredNorm();
    return {(ours->range_m.to_double() * u - exact->range_m * exact->direction).norm(),
            (turn - Mat3<double>::Identity()).norm() / std::sqrt(2.0), std::abs(ours->misfit_share.to_double() - share)};
}

TEST(FixedDirect, AgreesWithDoubleOnDipoles) {
    test::RandomPoses random(21);
    double worst_near = 0;
    double worst_far = 0;
    double worst_attitude = 0;
    for (int n = 0; n < 20'000; ++n) {
        const double range = random.uniform(0.15, 1.2);
        const auto codes = as_codes(test::unit_signal(range * random.direction(), random.attitude()));
        const Difference d = difference_to_double(codes, 1);
        (range <= 0.5 ? worst_near : worst_far) =
            std::max(range <= 0.5 ? worst_near : worst_far, range <= 0.5 ? d.position_m : d.position_m / range);
        worst_attitude = std::max(worst_attitude, d.attitude_rad);
        ASSERT_LT(d.misfit_share, 1e-6);
    }
    RecordProperty("worst_position_to_half_a_metre_nm", static_cast<int>(worst_near * 1e9));
    std::printf("arithmetic alone: %.3g mm up to 0.5 m, %.3g %% of range up to 1.2 m, %.3g deg\n", worst_near * 1e3,
                worst_far * 100, worst_attitude * 57.29578);
    EXPECT_LT(worst_near, 2e-8);      // required: 5e-5 m
    EXPECT_LT(worst_far, 5e-8);       // required: 5e-4
    EXPECT_LT(worst_attitude, 5e-7);  // required: 8.7e-5 rad
}

TEST(FixedDirect, AgreesWithDoubleOnDistortedAndNoisyMatrices) {
    test::RandomPoses random(22);
    for (int n = 0; n < 5000; ++n) {
        const Mat3<double> x = test::unit_signal(0.4 * random.direction(), random.attitude());
        const auto codes = as_codes(x + 0.05 * x.norm() * random.gaussian_matrix());
        const Difference d = difference_to_double(codes, 1);
        ASSERT_LT(d.position_m, 5e-6);
        ASSERT_LT(d.attitude_rad, 2e-5);
        ASSERT_LT(d.misfit_share, 1e-6);
    }
}

TEST(FixedDirect, NoTroubleOnAxesAndAtPoles) {
    for (int axis = 0; axis < 3; ++axis) {
        for (const double side : {-0.5, 0.5}) {
            for (const double theta : {-1.5707963267948966, 0.0, 1.5707963267948966}) {
                const Mat3<double> o = geometry::attitude_matrix(geometry::Euler<double>{0.3, theta, 0});
                const Vec3<double> p = side * Vec3<double>::Unit(axis);
                const Difference d = difference_to_double(as_codes(field::signal_matrix<double>(1, p, o)), 1);
                EXPECT_LT(d.position_m, 1e-6);
                EXPECT_LT(d.attitude_rad, 3e-6);
            }
        }
    }
}

/// The same mantissas at any exponent: block normalisation leaves every bit as it is.
TEST(FixedDirect, WorksAtAnyScale) {
    const auto codes = as_codes(test::unit_signal({0.4, 0.1, -0.3}, Quat<double>(0.9, 0.1, -0.3, 0.2).normalized()));
    const auto at_one = solve_direct(codes, scaled_from(1));
    for (const int exponent : {-60, -20, 20, 60}) {
        BlockMatrix moved = codes;
        moved.exponent += exponent;
        const auto s = solve_direct(moved, scaled_from(std::ldexp(1.0, exponent)));
        ASSERT_TRUE(s.ok());
        EXPECT_EQ(s->range_m, at_one->range_m);
        EXPECT_TRUE(s->direction == at_one->direction);
        EXPECT_TRUE(s->attitude == at_one->attitude);
    }
    for (const double c : {1e9, 1e-9}) {  // 510 m, which saturates, and 0.51 mm
        const auto s = solve_direct(codes, scaled_from(c));
        ASSERT_TRUE(s.ok());
        EXPECT_NEAR(s->range_m.to_double(), std::min(0.50990195 * std::cbrt(c), 8.0), 1e-6);
    }
}

TEST(FixedDirect, RefusesDegenerateMatrices) {
    const auto good = as_codes(test::unit_signal({0.4, 0.1, -0.3}, Quat<double>::Identity()));
    BlockMatrix dead = good;
    dead.mantissa.row(1).setZero();
    BlockMatrix ones;
    ones.mantissa.setConstant(1);
    EXPECT_EQ(solve_direct({}, scaled_from(1)).status().code(), StatusCode::degenerate);
    EXPECT_EQ(solve_direct(dead, scaled_from(1)).status().code(), StatusCode::degenerate);
    EXPECT_EQ(solve_direct(ones, scaled_from(1)).status().code(), StatusCode::degenerate);
    EXPECT_EQ(solve_direct(good, Scaled{}).status().code(), StatusCode::invalid_argument);
    EXPECT_EQ(solve_direct(good, scaled_from(-1)).status().code(), StatusCode::invalid_argument);
    BlockMatrix reversed = good;
    reversed.mantissa.col(1) *= -1;
    EXPECT_FALSE(solve_direct(reversed, scaled_from(1))->right_handed);
}

double misfit_squared(const DirectSolution& s, const Mat3<double>& x) {
    const double k = std::ldexp(s.strength.mantissa, s.strength.exponent);
    return (x - k * to_double(s.attitude) * field::dipole_factor<double>(to_double(s.direction))).squaredNorm();
}

/// Arbitrary mantissas give either a refusal, or unit vectors and rotations; no undefined behaviour.
TEST(FixedDirect, SurvivesArbitraryMantissas) {
    std::mt19937_64 random(23);
    int solved = 0;
    double worst_above = 0;
    for (int n = 0; n < 50'000; ++n) {
        BlockMatrix x;
        x.exponent = static_cast<int>(random() % 200) - 100;
        for (Index i = 0; i < 9; ++i) {
            const auto bits = static_cast<std::int32_t>(static_cast<std::uint32_t>(random()));
            x.mantissa(i) = random() % 8 == 0 ? std::numeric_limits<std::int32_t>::min() : bits >> (random() % 32);
        }
        const auto s = solve_direct(x, scaled_from(0.01));
        if (!s.ok()) {
            continue;
        }
        ++solved;
        ASSERT_NEAR(to_double(s->direction).norm(), 1, 1e-7);
        ASSERT_GE(s->range_m.raw(), 0);
        ASSERT_LE(std::abs(s->misfit_share.to_double()), 1.0);
        const auto exact = solver::solve_direct<double>(as_double(x), 0.01);
        if (exact.ok()) {
            const double power = as_double(x).squaredNorm();
            worst_above = std::max(worst_above, (misfit_squared(*s, as_double(x)) - exact->misfit_squared) / power);
        }
    }
    std::printf("misfit above the least: %.3g of |X|^2\n", worst_above);
    EXPECT_LT(worst_above, 1e-4);
    EXPECT_GT(solved, 5'000);
}

}  // namespace
}  // namespace tricoil::fixed

#include "core/solver/single_coil.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "tests/support/random_poses.hpp"

namespace tricoil::solver {
namespace {

template <typename Scalar>
using Couplings = std::vector<Scalar>;

/// Eight coils around a square of 0.3 m; their moments in different directions, or all along z.
template <typename Scalar>
field::Generator<Scalar> planar(bool is_flat, Scalar octupole_m2 = 0) {
    field::Generator<Scalar> generator;
    for (int cell = 0; cell < 9; ++cell) {
        if (cell != 4) {
            const double turn = 2.4 * cell;
            const Vec3<double> moment =
                is_flat ? Vec3<double>(0, 0, 5e-3) : Vec3<double>(3.5e-3 * std::cos(turn), 3.5e-3 * std::sin(turn), 3.5e-3);
            const Vec3<double> place(0.15 * (cell % 3 - 1), 0.15 * (cell / 3 - 1), 0);
            EXPECT_TRUE(generator.push_back({place.cast<Scalar>(), moment.cast<Scalar>(), octupole_m2}));
        }
    }
    return generator;
}

template <typename Scalar>
Couplings<Scalar> couplings_of(const field::Generator<Scalar>& generator, const SingleCoilPose<Scalar>& pose) {
    Couplings<Scalar> result;
    for (const auto& coil : generator) {
        result.push_back(field::coil_coupling<Scalar>(coil, pose.position_m, pose.sensitivity).value);
    }
    return result;
}

/// In the volume above the generator.
template <typename Scalar>
SingleCoilPose<Scalar> random_pose(test::RandomPoses& random, double gain) {
    const Vec3<double> p(random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15), random.uniform(0.1, 0.4));
    return {p.cast<Scalar>(), Vec3<double>(gain * random.direction()).cast<Scalar>()};
}

template <typename Scalar>
SingleCoilParams<Scalar> above(Scalar gain = 0) {
    SingleCoilParams<Scalar> params;
    params.gain = gain;
    params.side = Vec3<Scalar>::UnitZ();
    return params;
}

template <typename Scalar>
Couplings<Scalar> weights(std::size_t count, double sigma) {
    return Couplings<Scalar>(count, Scalar(1 / sigma));
}

template <typename Scalar>
auto solved(const field::Generator<Scalar>& generator, const Couplings<Scalar>& c, double sigma,
            const SingleCoilParams<Scalar>& params) {
    const Couplings<Scalar> w = weights<Scalar>(c.size(), sigma);
    return solve_single_coil<Scalar>(generator, {c, w}, params);
}

TEST(GeneratorCoupling, GradientsAreThoseOfFiniteDifferences) {
    test::RandomPoses random(1);
    const auto generator = planar<double>(false, 2e-4);
    for (int i = 0; i < 200; ++i) {
        const auto pose = random_pose<double>(random, 1.3);
        const auto& coil = generator[static_cast<std::size_t>(i % 8)];
        const auto x = field::coil_coupling<double>(coil, pose.position_m, pose.sensitivity);
        for (int k = 0; k < 3; ++k) {
            const Vec3<double> step = 1e-5 * Vec3<double>::Unit(k);
            const auto slope = [&](const Vec3<double>& by_p, const Vec3<double>& by_n) {
                return (field::coil_coupling<double>(coil, pose.position_m + by_p, pose.sensitivity + by_n).value -
                        field::coil_coupling<double>(coil, pose.position_m - by_p, pose.sensitivity - by_n).value) /
                       2e-5;
            };
            const Vec3<double> none = Vec3<double>::Zero();
            EXPECT_NEAR(x.by_displacement_per_m(k), slope(step, none), 1e-6 * x.by_displacement_per_m.norm() + 1e-8);
            EXPECT_NEAR(x.by_sensitivity(k), slope(none, step), 1e-8 * x.by_sensitivity.norm() + 1e-9);
        }
    }
}

template <typename Scalar>
void expect_exact(bool is_flat, Scalar gain, double tolerance_m) {
    test::RandomPoses random(2);
    const auto generator = planar<Scalar>(is_flat, Scalar(1e-4));
    for (int i = 0; i < 300; ++i) {
        const auto pose = random_pose<Scalar>(random, 1.2);
        const Couplings<Scalar> c = couplings_of(generator, pose);
        double largest = 0;
        for (const Scalar value : c) {
            largest = std::max(largest, double(std::abs(value)));
        }
        const auto found = solved<Scalar>(generator, c, 1e-5 * largest, above<Scalar>(gain));
        ASSERT_TRUE(found.ok());
        ASSERT_TRUE(found->converged()) << "pose " << i;
        EXPECT_LT(double((found->pose.position_m - pose.position_m).norm()), tolerance_m);
        EXPECT_LT(double((found->pose.sensitivity - pose.sensitivity).norm()), 30 * tolerance_m);
    }
}

TEST(SingleCoil, FindsExactPosesWithoutAStart) {
    expect_exact<double>(true, 0, 1e-6);
    expect_exact<double>(false, 0, 1e-6);
    expect_exact<double>(false, 1.2, 1e-6);
}

TEST(SingleCoil, FloatIsAsGoodAsItsRounding) { expect_exact<float>(false, 1.2F, 1e-4); }

TEST(SingleCoil, CovarianceIsThatOfTheErrors) {
    test::RandomPoses random(3);
    const auto generator = planar<double>(false);
    double squares = 0;
    double axis_squares = 0;
    double gain_squares = 0;
    constexpr int kPoses = 2000;
    for (int i = 0; i < kPoses; ++i) {
        const double gain = 1 + 2e-3 * random.gaussian_vector()(0);
        const auto pose = random_pose<double>(random, gain);
        Couplings<double> c = couplings_of(generator, pose);
        for (double& value : c) {
            value += 1e-6 * random.gaussian_vector()(0);
        }
        const auto found = solved<double>(generator, c, 1e-6, above<double>(1));
        ASSERT_TRUE(found.ok() && found->converged());
        const Vec3<double> error = found->pose.position_m - pose.position_m;
        squares += error.dot(Mat3<double>(found->covariance.topLeftCorner<3, 3>()).inverse() * error) / 3;
        const Vec3<double> axis = found->pose.sensitivity.normalized();
        const Mat3<double> of_axis = found->covariance.bottomRightCorner<3, 3>();
        EXPECT_NEAR(axis.dot(of_axis * axis), 0, 1e-12);
        const Vec3<double> turned = axis - pose.sensitivity.normalized();
        axis_squares += turned.squaredNorm() / of_axis.trace();
        gain_squares += std::pow((found->pose.sensitivity.norm() - gain) / found->gain_deviation, 2);
    }
    EXPECT_NEAR(squares / kPoses, 1, 0.06);
    EXPECT_NEAR(axis_squares / kPoses, 1, 0.08);
    EXPECT_NEAR(gain_squares / kPoses, 1, 0.12);
}

TEST(SingleCoil, FlatCoilsDoNotShowTheSide) {
    const SingleCoilPose<double> pose{Vec3<double>(0.05, -0.02, 0.2), Vec3<double>(0.3, 0.5, 0.8)};
    for (const bool is_flat : {true, false}) {
        const auto generator = planar<double>(is_flat);
        const auto found = solved<double>(generator, couplings_of(generator, pose), 1e-7, {});
        ASSERT_TRUE(found.ok());
        EXPECT_EQ(found->end, is_flat ? SingleCoilEnd::ambiguous : SingleCoilEnd::converged);
        EXPECT_NEAR(std::abs(found->pose.position_m.z()), 0.2, 1e-6);
    }
}

TEST(SingleCoil, NothingIsFoundInThePlaneOfFlatCoils) {
    const auto generator = planar<double>(true);
    const Couplings<double> c = couplings_of<double>(generator, {Vec3<double>(0.04, 0.03, 0), Vec3<double>(0.1, 0.2, 0.9)});
    const auto found = solved<double>(generator, c, 1e-7, above<double>());
    ASSERT_TRUE(found.ok());
    EXPECT_FALSE(found->converged());
}

TEST(SingleCoil, CouplingsOfNoSensorAreAWrongMinimum) {
    const auto generator = planar<double>(false);
    const auto found = solved<double>(generator, {1e-3, -2e-3, 1e-3, 3e-3, -1e-3, 2e-3, -3e-3, 1e-3}, 1e-7, above<double>());
    ASSERT_TRUE(found.ok());
    EXPECT_FALSE(found->converged());
}

TEST(SingleCoil, BadInputIsNamed) {
    const auto generator = planar<double>(false);
    const SingleCoilPose<double> pose{Vec3<double>(0.05, -0.02, 0.2), Vec3<double>(0.3, 0.5, 0.8)};
    const Couplings<double> good = couplings_of(generator, pose);
    const auto code = [&](Couplings<double> c, Couplings<double> w, double gain) {
        return solve_single_coil<double>(generator, {c, w}, above<double>(gain)).status().code();
    };
    const Couplings<double> equal = weights<double>(8, 1e-6);
    Couplings<double> five = equal;
    five[0] = five[3] = five[6] = 0;
    EXPECT_EQ(code(good, equal, 0), StatusCode::ok);
    EXPECT_EQ(code(good, five, 1), StatusCode::ok);
    EXPECT_EQ(code(good, five, 0), StatusCode::invalid_argument);
    EXPECT_EQ(code(good, weights<double>(7, 1e-6), 0), StatusCode::invalid_argument);
    EXPECT_EQ(code(good, equal, -1), StatusCode::invalid_argument);
    EXPECT_EQ(code(Couplings<double>(8, 0.0), equal, 0), StatusCode::degenerate);
    Couplings<double> bad = good;
    bad[2] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(code(bad, equal, 0), StatusCode::not_finite);
}

TEST(SingleCoil, RefinesFromTheLastPose) {
    test::RandomPoses random(4);
    const auto generator = planar<double>(false);
    for (int i = 0; i < 100; ++i) {
        const auto pose = random_pose<double>(random, 1);
        const Couplings<double> c = couplings_of(generator, pose);
        const Couplings<double> w = weights<double>(8, 1e-7);
        auto params = above<double>(1);
        params.start_m = pose.position_m + 0.01 * random.direction();
        const auto found = solve_single_coil<double>(generator, {c, w}, params);
        ASSERT_TRUE(found.ok() && found->converged());
        EXPECT_LE(found->iterations, 6);
        EXPECT_LT((found->pose.position_m - pose.position_m).norm(), 1e-6);
    }
}

}  // namespace
}  // namespace tricoil::solver

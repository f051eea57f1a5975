// CoilCorrection against the general dipole: couplings of misaligned coils are corrected to those of ideal coils.
#include <gmock/gmock.h>

#include <random>

#include "core/calibration/coil_correction.hpp"
#include "core/geometry/rotations.hpp"
#include "core/linear/eigen.hpp"
#include "core/solver/direct.hpp"
#include "tests/support/approx.hpp"

namespace tricoil::calibration {
namespace {

using Correction = CoilCorrection<double>;

Vec3<double> random_vector(std::mt19937_64& random) {
    std::normal_distribution<> normal;
    return {normal(random), normal(random), normal(random)};
}

Mat3<double> random_rotation(std::mt19937_64& random) {
    return geometry::rotation_vector_to_quaternion<double>(random_vector(random).norm() * random_vector(random).normalized())
        .toRotationMatrix();
}

/// Unequal gains; random pick-up and phases, sensor coil axes and rotation of the source; every third triad has a reversed source
/// coil.
Calibration<double> misaligned_calibration(int n, std::mt19937_64& random) {
    Calibration<double> c;
    const Vec3<double> gain(5e-3, 7e-3, n % 3 == 0 ? -9e-3 : 9e-3);
    const Mat3<double> turn =
        geometry::rotation_vector_to_quaternion<double>(0.3 * random_vector(random).normalized()).toRotationMatrix();
    c.model.source_moment = turn * gain.asDiagonal();
    c.model.sensor_sensitivity = Mat3<double>::Identity() + 0.1 * Mat3<double>(Eigen::Matrix3d::Random());
    c.phase_rad = 0.2 * Mat3<double>(Eigen::Matrix3d::Random());
    for (PickUp<double>* pick_up : {&c.pick_up, &c.low_band.pick_up}) {
        pick_up->in_phase = 1e-3 * Mat3<double>(Eigen::Matrix3d::Random());
        pick_up->quadrature = 1e-3 * Mat3<double>(Eigen::Matrix3d::Random());
    }
    return c;
}

TEST(CoilCorrection, MakesMisalignedCoilsIdealAtEveryPose) {
    std::mt19937_64 random(7);
    std::printf("seed 7\n");
    for (int n = 0; n < 500; ++n) {
        const auto c = misaligned_calibration(n, random);
        const auto columns = Correction::ideal_triads(c);
        ASSERT_TRUE(columns.ok()) << columns.status().message();
        const Vec3<double> position = (0.2 + 0.01 * (n % 100)) * random_vector(random).normalized();
        const Mat3<double> attitude = random_rotation(random);  // O: sensor from source
        const Mat3<double> x = field::signal_matrix(c.model, position, attitude);
        Mat3<double> ideal;
        for (int j = 0; j < 3; ++j) {
            Vec3<double> in_phase = eigen(c.phase_rad.col(j)).array().cos() * eigen(x.col(j)).array();
            Vec3<double> quadrature = eigen(c.phase_rad.col(j)).array().sin() * eigen(x.col(j)).array();
            in_phase += c.pick_up.in_phase.col(j);
            quadrature += c.pick_up.quadrature.col(j);
            Vec3<double> sigma = Vec3<double>::Ones();
            columns->correct_column(j, in_phase, quadrature, sigma);
            ideal.col(j) = in_phase;
            EXPECT_LT(quadrature.norm(), 1e-12 * in_phase.norm()) << "the correction must remove the quadrature";
            EXPECT_NEAR(sigma.mean(), 1 / c.model.source_moment.col(j).norm(), 0.4 / c.model.source_moment.col(j).norm());
        }
        const auto pose = solver::solve_direct(ideal, 1.0);
        ASSERT_TRUE(pose.ok());
        const Vec3<double> found = columns->axes() * (pose->range_m * pose->direction);
        const double sign = found.dot(position) < 0 ? -1 : 1;  // couplings at p and -p are equal
        EXPECT_LT((sign * found - position).norm(), 1e-9);
        EXPECT_LT((pose->attitude * columns->axes().transpose() - attitude).norm(), 1e-9);
    }
}

TEST(CoilCorrection, LowBandBecomesThatOfTheHighBand) {
    std::mt19937_64 random(8);
    for (int n = 0; n < 100; ++n) {
        auto c = misaligned_calibration(n, random);
        c.low_band.ratio = Mat3<double>::Ones() + 0.1 * Mat3<double>(Eigen::Matrix3d::Random());
        c.low_band.phase_rad = 0.2 * Mat3<double>(Eigen::Matrix3d::Random());
        const auto columns = Correction::ideal_triads(c);
        ASSERT_TRUE(columns.ok()) << columns.status().message();
        const auto measured = [](const Vec3<double>& coupling, const auto& phase_rad, const PickUp<double>& pick_up, int j,
                                 const auto& correct) {
            Vec3<double> in_phase = eigen(phase_rad).array().cos() * eigen(coupling).array();
            Vec3<double> quadrature = eigen(phase_rad).array().sin() * eigen(coupling).array();
            in_phase += pick_up.in_phase.col(j);
            quadrature += pick_up.quadrature.col(j);
            Vec3<double> sigma = Vec3<double>::Ones();
            correct(in_phase, quadrature, sigma);
            EXPECT_LT(quadrature.norm(), 1e-12 * in_phase.norm());
            return in_phase;
        };
        for (int j = 0; j < 3; ++j) {
            const Vec3<double> coupling = random_vector(random);
            const Vec3<double> high = measured(coupling, c.phase_rad.col(j), c.pick_up, j,
                                               [&](auto&... column) { columns->correct_column(j, column...); });
            const Vec3<double> low =
                measured(coupling.cwiseProduct(c.low_band.ratio.col(j)), c.low_band.phase_rad.col(j), c.low_band.pick_up, j,
                         [&](auto&... column) { columns->correct_low_column(j, column...); });
            EXPECT_LT((low - high).norm(), 1e-12 * high.norm());
        }
    }
}

TEST(CoilCorrection, LeavesColumnsOfIdealCoilsUnchanged) {
    Calibration<double> c;
    const auto columns = Correction::ideal_triads(c);
    ASSERT_TRUE(columns.ok());
    Vec3<double> in_phase(1, 2, 3);
    Vec3<double> quadrature(4, 5, 6);
    Vec3<double> sigma(7, 8, 9);
    columns->correct_column(1, in_phase, quadrature, sigma);
    EXPECT_TRUE(is_approx(in_phase, Vec3<double>(1, 2, 3)));
    EXPECT_TRUE(is_approx(quadrature, Vec3<double>(4, 5, 6)));
    EXPECT_TRUE(is_approx(sigma, Vec3<double>(7, 8, 9)));
    EXPECT_TRUE(columns->axes().isIdentity());
}

TEST(CoilCorrection, RefusesErrorsThatOneColumnDoesNotDetermine) {
    const auto reason = [](const Calibration<double>& c) { return std::string(Correction::ideal_triads(c).status().message()); };
    Calibration<double> skewed;
    skewed.model.source_moment(0, 1) = 0.01;
    EXPECT_THAT(reason(skewed), ::testing::HasSubstr("not orthogonal"));
    Calibration<double> apart;
    apart.model.source_offset_m(0, 0) = 0.005;
    EXPECT_THAT(reason(apart), ::testing::HasSubstr("coil offsets exceed"));
    Calibration<double> large;
    large.model.sensor_octupole_m2(1) = 1e-3;
    EXPECT_THAT(reason(large), ::testing::HasSubstr("too large"));
    Calibration<double> broken;
    broken.phase_rad(0, 0) = std::nan("");
    EXPECT_THAT(reason(broken), ::testing::HasSubstr("NaN"));
    Calibration<double> nearly;
    nearly.model.source_moment(0, 1) = 5e-4;
    EXPECT_TRUE(Correction::ideal_triads(nearly).ok());
}

}  // namespace
}  // namespace tricoil::calibration

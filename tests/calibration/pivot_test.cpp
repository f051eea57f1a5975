// Tip of a pointer: errors against the covariance of the result, outliers, and motions that do not determine the tip.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <functional>
#include <random>

#include "board/host/calibration/pivot.hpp"
#include "board/support/errors.hpp"
#include "core/geometry/rotations.hpp"
#include "core/linear/eigen.hpp"
#include "tests/support/squared_sigmas.hpp"

namespace tricoil::host {
namespace {

using ::testing::HasSubstr;

const Vec3<double> kTip(0.14, -0.01, 0.03);
const Vec3<double> kPivot(0.5, 0.2, -0.1);

struct Pointing {
    std::size_t poses = 300;
    Vec3<double> tilt_rad{0.4, 0.4, 0.4};
    double position_sigma_m = 1e-4;
    double rotation_sigma_rad = 5e-4;
    double correlation = 0;  // of successive errors
    double stated = 1;       // standard deviations in the poses, relative to the true ones
};

/// Poses with errors that are correlated between position and rotation.
std::vector<PivotPose> point(const Pointing& p, std::uint64_t seed) {
    std::mt19937_64 engine(seed);
    std::normal_distribution<double> normal;
    const auto random = [&] {
        Vec6<double> v;
        for (double& x : v) {
            x = normal(engine);
        }
        return v;
    };
    Mat6<double> root = Mat6<double>::Identity();
    root.topLeftCorner<3, 3>() *= p.position_sigma_m;
    root.bottomRightCorner<3, 3>() *= p.rotation_sigma_rad;
    root(0, 4) = root(1, 3) = p.position_sigma_m / 2;
    std::vector<PivotPose> poses;
    Vec6<double> noise = random();
    for (std::size_t n = 0; n < p.poses; ++n) {
        const double t = 0.2 * static_cast<double>(n) * 300 / static_cast<double>(p.poses);
        const Vec3<double> turn(std::sin(t), std::sin(1.618 * t), std::sin(0.618 * t));
        const auto q = geometry::rotation_vector_to_quaternion<double>(p.tilt_rad.cwiseProduct(turn));
        noise = p.correlation * noise + std::sqrt(1 - p.correlation * p.correlation) * random();
        const Vec6<double> error = root * noise;
        PivotPose pose;
        pose.position_m = kPivot - q * kTip + error.head<3>();
        pose.q_source_sensor = geometry::rotation_vector_to_quaternion<double>(error.tail<3>()) * q;
        pose.covariance = p.stated * p.stated * root * root.transpose();
        poses.push_back(pose);
    }
    return poses;
}

PivotCalibration calibrate(const std::vector<PivotPose>& poses) { return calibrate_pivot(poses, "take"); }

struct Nees {
    double mean = 0;  // 3 if the covariance is correct
    Vec3<double> bias_sigmas = Vec3<double>::Zero();
    double worst_m = 0;
};

Nees monte_carlo(const Pointing& p, int runs) {
    Nees nees;
    for (int run = 0; run < runs; ++run) {
        const PivotCalibration found = calibrate(point(p, static_cast<std::uint64_t>(run + 1)));
        const Vec3<double> error = found.tip_m - kTip;
        nees.mean += test::squared_sigmas(error, found.tip_covariance_m2) / runs;
        nees.bias_sigmas += error.cwiseQuotient(found.tip_covariance_m2.diagonal().cwiseSqrt()) / std::sqrt(runs);
        nees.worst_m = std::max(nees.worst_m, error.norm());
    }
    return nees;
}

TEST(Pivot, CovarianceOfTheTipIsThatOfItsErrors) {
    const Nees nees = monte_carlo({}, 400);
    EXPECT_GT(nees.mean, 2.5);
    EXPECT_LT(nees.mean, 3.3);
    EXPECT_LT(nees.bias_sigmas.cwiseAbs().maxCoeff(), 3.5);
    EXPECT_LT(nees.worst_m, 0.15e-3);
}

/// Errors of a filter: 0.1 s at 240 Hz. Independent errors would have a covariance that is about 20 times smaller.
TEST(Pivot, CovarianceIncludesTheCorrelationOfSuccessiveErrors) {
    Pointing filtered;
    filtered.poses = 3000;
    filtered.correlation = 0.96;
    const Nees nees = monte_carlo(filtered, 60);
    EXPECT_GT(nees.mean, 1.7);
    EXPECT_LT(nees.mean, 4.4);
}

/// Poses whose stated standard deviations are half of their true errors.
TEST(Pivot, CovarianceFollowsTheResiduals) {
    Pointing doubtful;
    doubtful.stated = 0.5;
    const Nees nees = monte_carlo(doubtful, 200);
    EXPECT_GT(nees.mean, 2.2);
    EXPECT_LT(nees.mean, 3.9);
    EXPECT_NEAR(calibrate(point(doubtful, 1)).residual_sigmas, 2, 0.2);
}

/// Without the correction of the attitudes' errors, the tip is shorter by ten standard deviations.
/// Poses of a tracker that states no standard deviations.
TEST(Pivot, WithoutStatedDeviationsTheResidualsAreThem) {
    Pointing unknown;
    unknown.stated = 0;
    const Nees nees = monte_carlo(unknown, 200);
    EXPECT_GT(nees.mean, 2.2);
    EXPECT_LT(nees.mean, 3.8);
    EXPECT_NEAR(calibrate(point(unknown, 1)).residual_sigmas, 1, 0.1);
    unknown.position_sigma_m = 0.02;
    EXPECT_THAT([&] { (void)calibrate(point(unknown, 1)); }, ::testing::ThrowsMessage<InputError>(HasSubstr("is not at rest")));
}

TEST(Pivot, ErrorsOfTheAttitudeDoNotShortenTheTip) {
    Pointing noisy;
    noisy.poses = 1000;
    noisy.rotation_sigma_rad = 0.02;
    noisy.tilt_rad = {0.25, 0.25, 0.25};
    const Nees nees = monte_carlo(noisy, 100);
    EXPECT_LT(nees.bias_sigmas.cwiseAbs().maxCoeff(), 4);
    EXPECT_LT(nees.mean, 3.9);
}

TEST(Pivot, LeavesOutOutlyingPoses) {
    auto poses = point({}, 7);
    const Vec3<double> clean = calibrate(poses).tip_m;
    for (std::size_t n = 0; n < poses.size(); n += 3) {  // one third of the poses, as before and after the tip was in its hole
        poses[n].position_m += Vec3<double>(0.02, 0.05, n % 2 == 0 ? 0.1 : -0.3);
    }
    const PivotCalibration found = calibrate(poses);
    EXPECT_EQ(found.outliers, 100U);
    EXPECT_LT((found.tip_m - clean).norm(), 5e-5);
}

TEST(Pivot, WorksWithoutNoise) {
    Pointing exact;
    exact.position_sigma_m = exact.rotation_sigma_rad = 0;
    const PivotCalibration found = calibrate(point(exact, 1));
    EXPECT_LT((found.tip_m - kTip).norm(), 1e-9);
    EXPECT_EQ(found.outliers, 0U);
}

void expect_refused(const std::vector<PivotPose>& poses, const std::string& why) {
    try {
        const PivotCalibration found = calibrate(poses);
        ADD_FAILURE() << "not refused: " << why << "; tip " << eigen(found.tip_m).transpose() << ", tilt " << found.tilt_deg;
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), HasSubstr(why));
        EXPECT_THAT(error.what(), HasSubstr("take: "));
    }
}

TEST(Pivot, RefusesRotationAboutOneAxis) {
    for (const Vec3<double>& axis : {Vec3<double>(0, 0, 0.5), Vec3<double>(0.5, 0, 0), Vec3<double>(0, 0.5, 0)}) {
        Pointing one_axis;
        one_axis.tilt_rad = axis;
        expect_refused(point(one_axis, 3), "about one axis only");
        one_axis.tilt_rad += 0.03 * Vec3<double>::Ones();  // trembling
        expect_refused(point(one_axis, 3), "about one axis only");
        one_axis.position_sigma_m = one_axis.rotation_sigma_rad = 0;
        one_axis.tilt_rad = axis;
        expect_refused(point(one_axis, 3), "about one axis only");
    }
}

/// Noise looks like rotation about all axes.
TEST(Pivot, RefusesRotationAboutOneAxisWithLargeNoise) {
    Pointing one_axis;
    one_axis.tilt_rad = {0, 0, 0.5};
    one_axis.rotation_sigma_rad = 0.1;
    expect_refused(point(one_axis, 3), "about one axis only");
}

TEST(Pivot, RefusesTooLittleRotation) {
    Pointing little;
    little.tilt_rad = {0.05, 0.05, 0.05};
    expect_refused(point(little, 3), "the poses turn by only ");
    little.tilt_rad.setZero();
    expect_refused(point(little, 3), "the poses turn by only ");
}

TEST(Pivot, RefusesATipThatMoves) {
    auto poses = point({}, 3);
    for (std::size_t n = 0; n < poses.size(); ++n) {
        poses[n].position_m.x() += 2e-5 * static_cast<double>(n);  // slides by 6 mm
    }
    expect_refused(poses, "the tip is not at rest");
}

TEST(Pivot, RefusesFewPoses) {
    auto poses = point({}, 3);
    poses.resize(9);
    expect_refused(poses, "9 valid poses; at least 10");
    poses.clear();
    expect_refused(poses, "0 valid poses");
}

}  // namespace
}  // namespace tricoil::host

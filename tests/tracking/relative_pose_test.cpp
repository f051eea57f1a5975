// Pose relative to a reference sensor: geometry, covariance against samples, flags, interpolation.
#include <gtest/gtest.h>

#include <random>

#include <Eigen/Eigenvalues>

#include "core/geometry/rotations.hpp"
#include "core/linear/eigen.hpp"
#include "core/tracking/relative_pose.hpp"

namespace tricoil::tracking {
namespace {

class RelativePose : public ::testing::Test {
protected:
    Vec3<double> vector(double size) { return size * Vec3<double>(normal_(random_), normal_(random_), normal_(random_)); }
    PoseEstimate<double> pose(std::uint8_t sensor) {
        PoseEstimate<double> e;
        e.sensor = sensor;
        e.position_m = vector(0.5);
        e.q_source_sensor = geometry::rotation_vector_to_quaternion<double>(vector(1));
        const Mat6<double> root = this->root();
        e.covariance = root * root.transpose();
        e.state = TrackerState::tracking;
        return e;
    }
    Mat6<double> root() {
        Mat6<double> root;
        for (double& entry : root.reshaped()) {
            entry = 1e-3 * normal_(random_);
        }
        return root;
    }
    /// L of L L^T.
    static Mat6<double> factor(const Mat6<double>& covariance) {
        return Eigen::Matrix<double, 6, 6>(eigen(covariance).llt().matrixL());
    }
    Vec6<double> sample(const Mat6<double>& covariance) {
        Vec6<double> z;
        z << vector(1), vector(1);
        return factor(covariance) * z;
    }
    static PoseEstimate<double> displaced(PoseEstimate<double> e, const Vec6<double>& error) {
        e.position_m += error.head<3>();
        e.q_source_sensor = geometry::rotation_vector_to_quaternion<double>(error.tail<3>()) * e.q_source_sensor;
        return e;
    }

private:
    std::mt19937_64 random_{7};
    std::normal_distribution<double> normal_;
};

TEST_F(RelativePose, IsTheSensorInTheFrameOfTheReference) {
    for (int n = 0; n < 100; ++n) {
        const auto reference = pose(1);
        const auto estimate = pose(0);
        const auto seen = relative_pose(estimate, reference);
        const Vec3<double> point = vector(1);  // of the sensor's body
        const Vec3<double> in_source = estimate.position_m + estimate.q_source_sensor * point;
        const Vec3<double> by_reference = seen.position_m + seen.q_source_sensor * point;
        EXPECT_LT((reference.position_m + reference.q_source_sensor * by_reference - in_source).norm(), 1e-14);
        // A motion of both as one body does not change it.
        const Quat<double> turn = geometry::rotation_vector_to_quaternion<double>(vector(1));
        const Vec3<double> shift = vector(1);
        auto moved = estimate;
        auto moved_reference = reference;
        for (auto* e : {&moved, &moved_reference}) {
            e->position_m = turn * e->position_m + shift;
            e->q_source_sensor = turn * e->q_source_sensor;
        }
        const auto again = relative_pose(moved, moved_reference);
        EXPECT_LT((again.position_m - seen.position_m).norm(), 1e-14);
        EXPECT_LT(geometry::angle_between(again.q_source_sensor, seen.q_source_sensor), 1e-7);
    }
}

TEST_F(RelativePose, CovarianceIsThatOfSamplesOfBothSensors) {
    for (int trial = 0; trial < 3; ++trial) {
        const auto reference = pose(1);
        const auto estimate = pose(0);
        const auto seen = relative_pose(estimate, reference);
        Mat6<double> sampled = Mat6<double>::Zero();
        constexpr int kSamples = 200'000;
        for (int n = 0; n < kSamples; ++n) {
            const auto there = relative_pose(displaced(estimate, sample(estimate.covariance)),
                                             displaced(reference, sample(reference.covariance)));
            Vec6<double> d;
            d << there.position_m - seen.position_m,
                geometry::quaternion_to_rotation_vector<double>(there.q_source_sensor * seen.q_source_sensor.conjugate());
            sampled += d * d.transpose() / kSamples;
        }
        EXPECT_LT((sampled - seen.covariance).norm(), 0.02 * seen.covariance.norm());
    }
}

TEST_F(RelativePose, OfTheReferenceItselfIsZeroWithoutUncertainty) {
    const auto reference = pose(2);
    const auto seen = relative_pose(reference, reference);
    EXPECT_LT(seen.position_m.norm(), 1e-15);
    EXPECT_LT(geometry::angle_between(seen.q_source_sensor, Quat<double>::Identity()), 1e-7);
    EXPECT_TRUE(seen.covariance.isZero(1e-12));
}

TEST_F(RelativePose, IsInvalidIfOneOfBothIs) {
    auto reference = pose(1);
    auto estimate = pose(0);
    reference.flags.set(PoseFlag::distorted);
    EXPECT_TRUE(relative_pose(estimate, reference).valid());
    EXPECT_TRUE(relative_pose(estimate, reference).flags.has(PoseFlag::distorted));
    reference.flags.set(PoseFlag::low_signal);
    reference.state = TrackerState::lost;
    EXPECT_FALSE(relative_pose(estimate, reference).valid());
    EXPECT_EQ(relative_pose(estimate, reference).state, TrackerState::lost);
    reference = pose(1);
    estimate.flags.set(PoseFlag::stale);
    EXPECT_FALSE(relative_pose(estimate, reference).valid());
}

TEST_F(RelativePose, InterpolationIsNeverTooSure) {
    for (int n = 0; n < 20; ++n) {
        auto before = pose(1);
        auto after = pose(1);
        before.time = device_time_us(1000);
        after.time = device_time_us(5000);
        before.flags.set(PoseFlag::low_signal);
        const auto middle = interpolated_pose(before, after, device_time_us(2000));
        EXPECT_EQ(middle.time, device_time_us(2000));
        EXPECT_LT((middle.position_m - 0.75 * before.position_m - 0.25 * after.position_m).norm(), 1e-15);
        EXPECT_NEAR(geometry::angle_between(middle.q_source_sensor, before.q_source_sensor),
                    0.25 * geometry::angle_between(after.q_source_sensor, before.q_source_sensor), 1e-7);
        EXPECT_FALSE(middle.valid());
        for (const double correlation : {-1.0, 0.0, 1.0}) {
            // Covariance of the position for errors L1 z and L2 z', z' = correlation z + ...
            const Mat6<double> first = factor(before.covariance);
            const Mat6<double> second = factor(after.covariance);
            const Mat6<double> cross = 0.75 * 0.25 * correlation * first * second.transpose();
            const Mat6<double> exact = 0.5625 * before.covariance + 0.0625 * after.covariance + cross + cross.transpose();
            const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> margin(eigen(middle.covariance - exact));
            EXPECT_GT(margin.eigenvalues().minCoeff(), -1e-12);
        }
    }
}

}  // namespace
}  // namespace tricoil::tracking

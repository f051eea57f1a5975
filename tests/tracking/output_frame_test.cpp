// Tip, boresight and alignment against composed transforms; the tip's covariance against samples.
#include "core/tracking/output_frame.hpp"
#include "core/geometry/rotations.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/geometry/angles.hpp"
#include "core/geometry/euler_order.hpp"
#include "core/linear/eigen.hpp"

namespace tricoil::tracking {
namespace {

class Random {
public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}
    Vec3<double> vector(double size) { return size * Vec3<double>(normal_(engine_), normal_(engine_), normal_(engine_)); }
    Quat<double> rotation() { return geometry::rotation_vector_to_quaternion<double>(vector(2)); }

private:
    std::mt19937_64 engine_;
    std::normal_distribution<double> normal_{0, 1};
};

PoseEstimate<double> random_pose(Random& random) {
    PoseEstimate<double> e;
    e.position_m = random.vector(0.5);
    e.q_source_sensor = random.rotation();
    return e;
}

TEST(OutputFrame, ChangesNothingByDefault) {
    Random random(1);
    PoseEstimate<double> e = random_pose(random);
    e.covariance = Mat6<double>::Identity();
    const auto seen = in_frame(e, {});
    EXPECT_LT((seen.position_m - e.position_m).norm(), 1e-15);
    EXPECT_LT(geometry::angle_between(seen.q_source_sensor, e.q_source_sensor), 1e-15);
    EXPECT_LT((seen.covariance - e.covariance).norm(), 1e-15);
}

TEST(OutputFrame, BoresightReadsZeroAndTurnsWithTheTool) {
    Random random(2);
    for (int n = 0; n < 100; ++n) {
        OutputFrame<double> frame;
        frame.q_source_alignment = random.rotation();
        const auto e = random_pose(random);
        const Quat<double> reading = random.rotation();
        boresight(frame, e.q_source_sensor);
        EXPECT_LT(geometry::angle_between(in_frame(e, frame).q_source_sensor, Quat<double>::Identity()), 1e-14);
        boresight(frame, e.q_source_sensor, reading);
        EXPECT_LT(geometry::angle_between(in_frame(e, frame).q_source_sensor, reading), 1e-14);
        // A turn of the tool about an axis of the alignment frame is a turn of the reading about the same axis.
        const Quat<double> turn = random.rotation();
        auto turned = e;
        turned.q_source_sensor = frame.q_source_alignment * turn * frame.q_source_alignment.conjugate() * e.q_source_sensor;
        EXPECT_LT(geometry::angle_between(in_frame(turned, frame).q_source_sensor, turn * reading), 1e-13);
    }
}

TEST(OutputFrame, AlignmentPointsReadAsTheyWereTouched) {
    Random random(3);
    for (int n = 0; n < 100; ++n) {
        OutputFrame<double> frame;
        frame.tip_m = random.vector(0.1);
        const Vec3<double> origin = random.vector(0.5);
        const Vec3<double> on_x = origin + random.vector(0.3);
        const Vec3<double> towards_y = origin + random.vector(0.3);
        ASSERT_TRUE(align(frame, origin, on_x, towards_y).ok());
        const auto touch = [&](const Vec3<double>& point) {
            auto e = random_pose(random);
            e.position_m = point - e.q_source_sensor * frame.tip_m;  // tip on the point, at any attitude of the tool
            return in_frame(e, frame).position_m;
        };
        EXPECT_LT(touch(origin).norm(), 1e-14);
        EXPECT_LT((touch(on_x) - Vec3<double>((on_x - origin).norm(), 0, 0)).norm(), 1e-13);
        EXPECT_NEAR(touch(towards_y).z(), 0, 1e-13);
        EXPECT_GT(touch(towards_y).y(), 0);
    }
}

TEST(OutputFrame, TipCovarianceIsThatOfSamples) {
    Random random(4);
    OutputFrame<double> frame;
    frame.tip_m = {0.1, -0.05, 0.2};
    frame.q_source_alignment = random.rotation();
    PoseEstimate<double> e = random_pose(random);
    const Mat6<double> root = 1e-3 * (Mat6<double>(Eigen::Matrix<double, 6, 6>::Random()) + Mat6<double>::Identity());
    e.covariance = root * root.transpose();
    const auto seen = in_frame(e, frame);
    Mat6<double> sampled = Mat6<double>::Zero();
    constexpr int kSamples = 200'000;
    for (int n = 0; n < kSamples; ++n) {
        Vec6<double> z;
        z << random.vector(1), random.vector(1);
        const Vec6<double> error = root * z;
        auto wrong = e;
        wrong.position_m += error.head<3>();
        wrong.q_source_sensor = geometry::rotation_vector_to_quaternion<double>(error.tail<3>()) * e.q_source_sensor;
        const auto there = in_frame(wrong, frame);
        Vec6<double> d;
        d << there.position_m - seen.position_m,
            geometry::quaternion_to_rotation_vector<double>(there.q_source_sensor * seen.q_source_sensor.conjugate());
        sampled += d * d.transpose() / kSamples;
    }
    EXPECT_LT((sampled - seen.covariance).norm(), 0.02 * seen.covariance.norm());
    const double sensor = e.covariance.topLeftCorner<3, 3>().trace();
    const double tip = seen.covariance.topLeftCorner<3, 3>().trace();
    EXPECT_GT(tip, 1.01 * sensor);
}

TEST(OutputFrame, RefusesPointsThatAreNoFrame) {
    OutputFrame<double> frame;
    const Vec3<double> o(0.3, 0, 0);
    const Vec3<double> x(0.4, 0, 0);
    EXPECT_EQ(align(frame, o, x, Vec3<double>(0.6, 0, 0)).code(), StatusCode::degenerate);
    EXPECT_EQ(align(frame, o, o, Vec3<double>(0.3, 1, 0)).code(), StatusCode::degenerate);
    EXPECT_EQ(align(frame, o, x, Vec3<double>(0.3, std::nan(""), 0)).code(), StatusCode::not_finite);
    EXPECT_TRUE(frame.origin_m.isZero(0));
}

TEST(EulerOrder, ComposesBackInAllSixOrders) {
    Random random(5);
    const std::array<geometry::AxisOrder, 6> orders{{{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}, {1, 0, 2}, {0, 2, 1}}};
    const auto about = [](std::size_t axis, double angle) {
        return geometry::rotation_vector_to_quaternion<double>(angle * Vec3<double>::Unit(static_cast<Index>(axis)));
    };
    for (const auto& order : orders) {
        for (int n = 0; n < 200; ++n) {
            Quat<double> q = random.rotation();
            if (n % 4 == 0) {  // at the pole
                q = about(order[0], random.vector(1).x()) * about(order[1], n % 8 == 0 ? M_PI / 2 : -M_PI / 2);
            }
            const Vec3<double> a = geometry::euler_angles<double>(q, order);
            const Quat<double> back = about(order[0], a(0)) * about(order[1], a(1)) * about(order[2], a(2));
            EXPECT_LT(geometry::angle_between(q, back), 3e-6);
            EXPECT_LE(std::abs(a(1)), M_PI / 2 + 1e-12);
        }
    }
}

/// The paper's azimuth, elevation and roll are the order z, y, x.
TEST(EulerOrder, ZyxIsTheOneOfTable1) {
    Random random(6);
    const Quat<double> q = random.rotation();
    const auto table = geometry::to_euler<double>(geometry::attitude_matrix(q));
    const Vec3<double> zyx = geometry::euler_angles<double>(q, {2, 1, 0});
    EXPECT_LT((zyx - Vec3<double>(table.azimuth_rad, table.elevation_rad, table.roll_rad)).norm(), 1e-12);
}

}  // namespace
}  // namespace tricoil::tracking

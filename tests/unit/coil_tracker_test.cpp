#include <gtest/gtest.h>

#include "tests/support/generator_body.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::tracking {
namespace {

/// Poses along the motion of test::GeneratorBody.
template <typename Scalar, typename Spoil>
std::vector<PoseEstimate<Scalar>> tracked(CoilTracker<Scalar>& tracker, int coils, int columns, Spoil spoil) {
    std::vector<PoseEstimate<Scalar>> poses;
    test::replay_generator<Scalar>(coils, columns, spoil, [&](const GeneratorColumn<Scalar>& column) {
        if (const auto pose = tracker.update(column)) {
            poses.push_back(*pose);
        }
    });
    return poses;
}

double error_m(const auto& pose) {
    const sim::Pose truth = test::GeneratorBody().at(to_seconds(pose.time));
    return (pose.position_m.template cast<double>() - truth.position_m).norm();
}
constexpr auto kClean = [](int, auto&) {};

TEST(GeneratorField, GradientsAreThoseOfFiniteDifferences) {
    test::RandomPoses random(5);
    for (const int coils : {1, 2}) {
        const auto field = test::generator_params<double>(coils, 1.3).field;
        for (int i = 0; i < 100; ++i) {
            const Vec3<double> p(random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15), random.uniform(0.1, 0.4));
            const Quat<double> q = geometry::rotation_vector_to_quaternion<double>(3 * random.direction());
            const auto at = field.column(p, geometry::attitude_matrix(q), i % 8);
            const double scale = at.column.norm() + at.by_rotation_per_rad.norm();
            for (int axis = 0; axis < 3; ++axis) {
                const Vec3<double> step = 1e-5 * Vec3<double>(Mat3<double>::Identity().col(axis));
                const Quat<double> turn = geometry::rotation_vector_to_quaternion<double>(step);
                const auto moved = field.column(p + step, geometry::attitude_matrix(q), i % 8).column;
                const auto turned = field.column(p, geometry::attitude_matrix(turn * q), i % 8).column;
                const Vec3<double> by_p = 1e5 * (moved - at.column);
                Vec3<double> by_r = 1e5 * (turned - at.column);
                if (coils == 1) {  // the part along the axis is that of the gain
                    by_r += (q * Vec3<double>::UnitX())(axis)*at.column;
                }
                EXPECT_LT((by_p - at.by_position_per_m.col(axis)).norm(), 1e-3 * at.by_position_per_m.norm());
                EXPECT_LT((by_r - at.by_rotation_per_rad.col(axis)).norm(), 1e-3 * scale);
            }
        }
    }
}

template <typename Scalar>
class CoilTracking : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(CoilTracking, Scalars);

TYPED_TEST(CoilTracking, FollowsCoilsAndBodies) {
    for (const auto& [coils, gain] : {std::pair{1, 1.0}, {1, 0.0}, {2, 1.0}}) {
        SCOPED_TRACE(testing::Message() << coils << " coils, gain " << gain);
        CoilTracker<TypeParam> tracker(test::generator_params<TypeParam>(coils, gain));
        const auto poses = tracked(tracker, coils, 800, kClean);
        ASSERT_EQ(poses.size(), 793U);                                     // the first needs a frame
        for (std::size_t n = gain > 0 ? 40 : 56; n < poses.size(); ++n) {  // an unknown gain is confirmed two frames later
            ASSERT_TRUE(poses[n].valid()) << n;
            ASSERT_LT(error_m(poses[n]), 5 * double(deviation_m(poses[n]))) << n;
            ASSERT_LT(error_m(poses[n]), 3e-3) << n;
        }
        EXPECT_EQ(poses.back().flags.has(PoseFlag::roll_undefined), coils == 1);
        EXPECT_NEAR(tracker.gain(), 1, 0.01);
        if (coils == 2) {
            const auto q = poses.back().q_source_sensor.template cast<double>();
            const sim::Pose body = test::GeneratorBody().at(799e-6 * static_cast<double>(test::kGeneratorSlot_us));
            EXPECT_LT(geometry::quaternion_to_rotation_vector<double>(q * body.q_source_sensor.conjugate()).norm(), 0.02);
        }
    }
}

TYPED_TEST(CoilTracking, RefusesAnOutlierAndRestartsAfterAJump) {
    CoilTracker<TypeParam> tracker(test::generator_params<TypeParam>(1));
    const auto poses = tracked(tracker, 1, 400, [](int n, auto& column) {
        if (n == 200) {
            column.in_phase(0) += TypeParam(1e-2);
        } else if (n > 300) {
            column.in_phase(0) = -column.in_phase(0);  // it points the other way
        }
    });
    EXPECT_TRUE(poses[200 - 7].flags.has(PoseFlag::unconfirmed));
    EXPECT_TRUE(poses[201 - 7].valid());
    EXPECT_EQ(tracker.counters().reacquisitions, 1U);
    EXPECT_EQ(tracker.counters().acquisitions, 2U);
    EXPECT_TRUE(poses.back().valid());
    EXPECT_LT(error_m(poses.back()), 3e-3);
}

TYPED_TEST(CoilTracking, RefusesBadColumns) {
    CoilTracker<TypeParam> tracker(test::generator_params<TypeParam>(1));
    const auto poses = tracked(tracker, 1, 100, [](int n, auto& column) {
        const auto nan = std::numeric_limits<TypeParam>::quiet_NaN();
        column.source = n == 30 ? 8 : column.source;
        column.in_phase(0) = n == 31 ? nan : column.in_phase(0);
        column.sigma(0) = n == 32 ? -1 : column.sigma(0);
        column.midpoint = n == 33 ? DeviceTime{} : column.midpoint;
    });
    EXPECT_EQ(poses.size(), 89U);
    EXPECT_TRUE(poses.back().valid());
}

TYPED_TEST(CoilTracking, FindsNoPoseOfASilentCoil) {
    CoilTracker<TypeParam> tracker(test::generator_params<TypeParam>(1));
    const auto poses = tracked(tracker, 1, 40, [](int, auto& column) { column.in_phase(0) = 0; });
    ASSERT_FALSE(poses.empty());
    for (const auto& pose : poses) {
        EXPECT_TRUE(pose.flags.has(PoseFlag::no_sensor));
        EXPECT_FALSE(pose.valid());
    }
}

}  // namespace
}  // namespace tricoil::tracking

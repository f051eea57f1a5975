#include "core/geometry/rotations.hpp"
#include "core/tracking/methods/any_tracker.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "tests/support/random_poses.hpp"

namespace tricoil::tracking {
namespace {

constexpr double kSigma = 1e-4;
constexpr Microseconds kSlot{1389};

/// Feeds a tracker columns of exact couplings, one slot after another.
class TrackerTest : public ::testing::Test {
protected:
    TrackerParams<double> params() const {
        TrackerParams<double> p;
        p.common.coupling_constant = 1.0;
        p.common.max_column_span = Microseconds{3500};
        return p;
    }

    Column<double> column(const Mat3<double>& x, int j) {
        Column<double> c;
        c.state = single_coil(j);
        c.midpoint = time_;
        c.in_phase = x.col(j);
        c.sigma.setConstant(kSigma);
        return c;
    }

    std::optional<PoseEstimate<double>> feed_frame(auto& tracker, const Mat3<double>& x) {
        std::optional<PoseEstimate<double>> last;
        for (int j = 0; j < 3; ++j) {
            last = tracker.update(column(x, j));
            time_ += kSlot;
        }
        return last;
    }

    const Vec3<double> position_{0.4, 0.2, -0.1};
    const Quat<double> attitude_ = Quat<double>(0.9, 0.1, -0.3, 0.2).normalized();
    const Mat3<double> x_ = test::unit_signal(position_, attitude_);
    DeviceTime time_ = device_time_us((std::int64_t{1} << 32) - 2000);  // exceeds 32 bits within the first frame
};

TEST_F(TrackerTest, EveryMethodFindsAStillSensor) {
    for (const MethodParams<double>& method : std::initializer_list<MethodParams<double>>{DirectParams{}, PreviousParams{}}) {
        auto p = params();
        p.method = method;
        AnyTracker tracker(p);
        feed_frame(tracker, x_);
        const auto estimate = feed_frame(tracker, x_);
        ASSERT_TRUE(estimate.has_value());
        EXPECT_TRUE(estimate->valid());
        EXPECT_LT((estimate->position_m - position_).norm(), 1e-12);
        EXPECT_LT(geometry::angle_between(estimate->q_source_sensor, attitude_), 1e-12);
        EXPECT_EQ(estimate->time, time_ - kSlot);
        EXPECT_EQ(tracker.state(), TrackerState::tracking);
        EXPECT_LT(estimate->distortion_chi_square, 1e-9);
    }
}

TEST_F(TrackerTest, HemisphereBySettingAndByContinuity) {
    DirectTracker<double> tracker(params());
    ASSERT_TRUE(tracker.set_hemisphere(-position_).ok());
    EXPECT_LT((feed_frame(tracker, x_)->position_m + position_).norm(), 1e-12);

    // Motion through x = 0, against the setting: the hemisphere follows by continuity.
    DirectTracker<double> follower(params());
    std::optional<PoseEstimate<double>> estimate;
    feed_frame(follower, test::unit_signal(Vec3<double>(0.3, 0.4, 0), attitude_));  // a first pose is unconfirmed
    for (double x = 0.3; x > -0.3; x -= 0.004) {
        const Vec3<double> p(x, 0.4, 0);
        estimate = feed_frame(follower, test::unit_signal(p, attitude_));
        EXPECT_LT((estimate->position_m - p).norm(), 1e-12);
        EXPECT_TRUE(estimate->valid());
    }
}

TEST_F(TrackerTest, WithoutHemisphereThePoseIsInvalid) {
    auto p = params();
    p.common.hemisphere.setZero();
    DirectTracker<double> tracker(p);
    EXPECT_TRUE(feed_frame(tracker, x_)->flags.has(PoseFlag::hemisphere_unknown));
    EXPECT_EQ(tracker.state(), TrackerState::searching);
    ASSERT_TRUE(tracker.set_hemisphere(position_).ok());
    EXPECT_TRUE(feed_frame(tracker, x_)->valid());
    EXPECT_EQ(tracker.set_hemisphere({std::numeric_limits<double>::quiet_NaN(), 0, 0}).code(), StatusCode::not_finite);
}

TEST_F(TrackerTest, LosesASilentSensorWithinBoundedTimeAndFindsItAgain) {
    DirectTracker<double> tracker(params());
    EXPECT_TRUE(feed_frame(tracker, x_)->flags.has(PoseFlag::unconfirmed));
    feed_frame(tracker, x_);
    EXPECT_FALSE(tracker.tick(time_ + Microseconds{50'000}).has_value());
    const auto stale = tracker.tick(time_ + Microseconds{150'000});
    ASSERT_TRUE(stale.has_value());
    EXPECT_TRUE(stale->flags.has(PoseFlag::stale));
    EXPECT_EQ(tracker.state(), TrackerState::lost);
    tracker.tick(time_ + Microseconds{1'500'000});
    EXPECT_EQ(tracker.state(), TrackerState::searching);
    time_ += Microseconds{2'000'000};
    feed_frame(tracker, x_);  // a column this far ahead is used only if the next one agrees
    EXPECT_EQ(tracker.counters().of(Rejection::time_ahead), 1U);
    // In two seconds the sensor may have crossed to the other hemisphere.
    EXPECT_TRUE(feed_frame(tracker, x_)->flags.has(PoseFlag::hemisphere_unknown));
    ASSERT_TRUE(tracker.set_hemisphere(position_).ok());
    EXPECT_TRUE(feed_frame(tracker, x_)->valid());
    EXPECT_EQ(tracker.counters().acquisitions, 2U);
}

TEST_F(TrackerTest, FlagsGiveTheReason) {
    const auto flags_of = [&](const Mat3<double>& x, ColumnFlags column_flags, double sigma) {
        DirectTracker<double> tracker(params());
        std::optional<PoseEstimate<double>> estimate;
        for (int n = 0; n < 9; ++n) {  // a first pose is unconfirmed; the motion is known from the third frame
            auto c = column(x, n % 3);
            c.flags = column_flags;
            c.sigma.setConstant(sigma);
            estimate = tracker.update(c);
            time_ += kSlot;
        }
        return estimate->flags;
    };
    Mat3<double> reversed = x_;
    reversed.row(2) *= -1;
    EXPECT_TRUE(flags_of(reversed, {}, kSigma).has(PoseFlag::wrong_handedness));
    EXPECT_TRUE(flags_of(x_, {ColumnFlag::saturated}, kSigma).has(PoseFlag::saturated));
    EXPECT_TRUE(flags_of(x_, {ColumnFlag::no_reference}, kSigma).has(PoseFlag::no_reference));
    EXPECT_TRUE(flags_of(x_, {}, 10.0).has(PoseFlag::low_signal));
    EXPECT_TRUE(flags_of(Mat3<double>::Ones(), {}, kSigma).has(PoseFlag::no_sensor));
    EXPECT_TRUE(flags_of(Mat3<double>::Zero(), {}, kSigma).has(PoseFlag::no_sensor));
    Mat3<double> crosstalk = Mat3<double>::Ones();
    crosstalk.diagonal() *= 1.3;
    EXPECT_TRUE(flags_of(crosstalk, {}, kSigma).has(PoseFlag::no_sensor));
    Mat3<double> metal = x_;
    metal.row(1) *= 1.01;
    const auto distorted = flags_of(metal, {}, kSigma);
    EXPECT_TRUE(distorted.has(PoseFlag::distorted));
    EXPECT_FALSE(distorted.has_any(kInvalidating));
    metal.row(1) *= 1.1;
    EXPECT_TRUE(flags_of(metal, {}, kSigma).has(PoseFlag::uncertain));
}

TEST_F(TrackerTest, DistortionChiSquareHasThreeDegreesOfFreedom) {
    test::RandomPoses random(11);
    DirectTracker<double> tracker(params());
    double sum = 0;
    constexpr int kFrames = 4000;
    for (int i = 0; i < kFrames; ++i) {
        sum += feed_frame(tracker, x_ + kSigma * random.gaussian_matrix())->distortion_chi_square;
    }
    EXPECT_NEAR(sum / kFrames, 3.0, 0.12);  // standard error sqrt(6 / 4000) = 0.039
}

/// Unconfirmed: the first pose, and a pose farther from the previous one than a body can move.
TEST_F(TrackerTest, APoseMustContinueTheLastOne) {
    for (const bool deskew : {false, true}) {
        auto p = params();
        p.method = DirectParams{deskew};
        DirectTracker<double> tracker(p);
        EXPECT_TRUE(feed_frame(tracker, x_)->flags.has(PoseFlag::unconfirmed));
        for (int frame = 0; frame < 3; ++frame) {
            feed_frame(tracker, x_);
        }
        EXPECT_TRUE(feed_frame(tracker, x_)->valid());
        const Mat3<double> elsewhere = test::unit_signal(Vec3<double>(0.6, 0.4, 0.1), attitude_);
        tracker.update(column(elsewhere, 0));
        time_ += kSlot;
        tracker.update(column(elsewhere, 1));
        time_ += kSlot;
        EXPECT_FALSE(tracker.update(column(elsewhere, 2))->valid());
    }
}

TEST_F(TrackerTest, BadColumnsAreRefusedCountedAndChangeNothing) {
    DirectTracker<double> tracker(params());
    feed_frame(tracker, x_);
    const auto refuse = [&](auto spoil, Rejection reason) {
        auto bad = column(x_, 0);
        spoil(bad);
        const auto before = tracker.counters().of(reason);
        EXPECT_FALSE(tracker.update(bad).has_value());
        EXPECT_EQ(tracker.counters().of(reason), before + 1);
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    refuse([&](auto& c) { c.in_phase(1) = nan; }, Rejection::not_finite);
    refuse([&](auto& c) { c.quadrature(2) = std::numeric_limits<double>::infinity(); }, Rejection::not_finite);
    refuse([&](auto& c) { c.sigma(0) = 0; }, Rejection::bad_sigma);
    refuse([&](auto& c) { c.sigma(0) = nan; }, Rejection::bad_sigma);
    refuse([&](auto& c) { c.state = Excitation::all; }, Rejection::unknown_state);
    refuse([&](auto& c) { c.midpoint -= Microseconds{100'000}; }, Rejection::time_backwards);
    refuse([&](auto& c) { c.midpoint = time_ - kSlot, c.state = Excitation::s3; }, Rejection::duplicate);
    const auto estimate = feed_frame(tracker, x_);
    EXPECT_TRUE(estimate->valid());
    EXPECT_LT((estimate->position_m - position_).norm(), 1e-12);
}

TEST_F(TrackerTest, ALostColumnIsNotBridged) {
    DirectTracker<double> tracker(params());
    feed_frame(tracker, x_);
    EXPECT_TRUE(tracker.update(column(x_, 0)).has_value());
    time_ += 2 * kSlot;  // no column of S2
    EXPECT_FALSE(tracker.update(column(x_, 2)).has_value());
}

TEST_F(TrackerTest, SimultaneousColumnsGiveOnePoseAFrame) {
    auto p = params();
    p.common.max_column_span = Microseconds{0};
    DirectTracker<double> tracker(p);
    for (int frame = 0; frame < 3; ++frame) {
        EXPECT_FALSE(tracker.update(column(x_, 0)).has_value());
        EXPECT_FALSE(tracker.update(column(x_, 1)).has_value());
        EXPECT_TRUE(tracker.update(column(x_, 2)).has_value());
        time_ += kSlot;
    }
}

/// Two turns about each axis: the sign of the quaternion that a solver returns changes on the way, that of a tracker does not.
TEST_F(TrackerTest, QuaternionSignsAreContinuous) {
    const std::initializer_list<MethodParams<double>> methods{DirectParams{}, PreviousParams{}, ScaatParams<double>{}};
    for (const MethodParams<double>& method : methods) {
        auto p = params();
        p.method = method;
        AnyTracker tracker(p);
        Quat<double> last = Quat<double>::Identity();
        double least = 1;
        for (int n = 0; n < 900; ++n) {
            const double angle = 4 * 3.14159265358979 * n / 300;
            const Quat<double> q = geometry::rotation_vector_to_quaternion<double>(angle * Vec3<double>::Unit(n / 300));
            if (const auto estimate = tracker.update(column(test::unit_signal(position_, q), n % 3))) {
                least = std::min(least, estimate->q_source_sensor.dot(last));
                last = estimate->q_source_sensor;
            }
            time_ += kSlot;
        }
        EXPECT_GT(least, 0.9) << method.index();
    }
}

TEST_F(TrackerTest, PreviousMethodReacquiresAfterAJump) {
    auto p = params();
    p.method = PreviousParams{};
    PreviousTracker<double> tracker(p);
    feed_frame(tracker, x_);
    const Vec3<double> elsewhere(0.1, -0.5, 0.3);
    const auto estimate = feed_frame(tracker, test::unit_signal(elsewhere, attitude_.conjugate()));
    ASSERT_TRUE(estimate.has_value());
    for (int i = 0; i < 4; ++i) {
        feed_frame(tracker, test::unit_signal(elsewhere, attitude_.conjugate()));
    }
    const auto settled = feed_frame(tracker, test::unit_signal(elsewhere, attitude_.conjugate()));
    const double off = std::min((settled->position_m - elsewhere).norm(), (settled->position_m + elsewhere).norm());
    EXPECT_LT(off, 1e-9);
}

TEST(TrackerParams, InvalidOnesAreRefusedWithAReason) {
    const auto refused = [](auto spoil) {
        TrackerParams<float> p;
        spoil(p);
        return !check(p).ok();
    };
    EXPECT_TRUE(check(TrackerParams<float>{}).ok());
    EXPECT_TRUE(refused([](auto& p) { p.common.coupling_constant = 0; }));
    EXPECT_TRUE(refused([](auto& p) { p.common.coupling_constant = std::numeric_limits<float>::quiet_NaN(); }));
    EXPECT_TRUE(refused([](auto& p) { p.method = PreviousParams{0}; }));
    EXPECT_TRUE(refused([](auto& p) { p.method = PreviousParams{11}; }));
    EXPECT_TRUE(refused([](auto& p) { p.common.min_snr = -1; }));
    EXPECT_TRUE(refused([](auto& p) { p.common.lost_after = Microseconds{0}; }));
    EXPECT_TRUE(refused([](auto& p) { p.common.hemisphere.x() = std::numeric_limits<float>::infinity(); }));
}

}  // namespace
}  // namespace tricoil::tracking

// Contract of all trackers: every method, in float, double and integers.
#include <gtest/gtest.h>

#include "tests/support/contract_subjects.hpp"

namespace tricoil::test {
namespace {

using tracking::PoseFlag;
using tracking::TrackerState;

constexpr double kPlace_m = 2.5;
constexpr Microseconds kLostAfter{100'000};
constexpr Microseconds kSearchAfter{1'000'000};

/// A sensor at rest on the x axis.
template <typename Subject>
class TrackerContract : public ::testing::Test {
protected:
    /// Frames of a good signal. Returns the last pose.
    Seen run(int frames) {
        Seen last;
        for (int n = 0; n < frames; ++n) {
            last = subject_.frame(kPlace_m).value_or(last);
        }
        return last;
    }

    /// Runs until the poses are valid. Returns the time of the last one.
    DeviceTime track() {
        const Seen last = run(30);
        EXPECT_TRUE(last.valid) << last.flags.bits();
        EXPECT_NEAR(last.x_m, kPlace_m, 0.01);
        EXPECT_EQ(subject_.tracker.state(), TrackerState::tracking);
        return last.time;
    }

    Subject subject_;
};

using Subjects = ::testing::Types<Direct<float>, Direct<double>, Previous<float>, Previous<double>, Scaat<float>, Scaat<double>,
                                  General<float>, General<double>, TwoBands, FilteredTwoBands, FixedDirect, FixedPrevious>;
TYPED_TEST_SUITE(TrackerContract, Subjects);

/// Trackers of columns; those in integers get blocks, without a low band.
template <typename Subject>
class ColumnTrackerContract : public TrackerContract<Subject> {};
using ColumnSubjects = ::testing::Types<Direct<float>, Direct<double>, Previous<float>, Previous<double>, Scaat<float>,
                                        Scaat<double>, General<float>, General<double>, TwoBands, FilteredTwoBands>;
TYPED_TEST_SUITE(ColumnTrackerContract, ColumnSubjects);

TYPED_TEST(TrackerContract, FindsAStillSensor) {
    EXPECT_EQ(this->subject_.tracker.state(), TrackerState::searching);
    EXPECT_FALSE(this->subject_.tracker.tick(this->subject_.now() + kSearchAfter)) << "a pose before the first column";
    this->track();
    EXPECT_EQ(this->subject_.tracker.counters().acquisitions, 1U);
}

/// The low band shows the sensor elsewhere, except to the tracker that uses it.
TYPED_TEST(ColumnTrackerContract, LowBandColumnsGiveNoPoseInEitherOrder) {
    const double low_m = std::is_same_v<TypeParam, TwoBands> || std::is_same_v<TypeParam, FilteredTwoBands> ? kPlace_m : 4;
    for (const bool low_first : {true, false}) {
        for (int n = 0; n < 30; ++n) {
            const bool gave_early = low_first && this->subject_.low_band(low_m, true);
            const auto pose = this->subject_.frame(kPlace_m);
            const bool gave_late = !low_first && this->subject_.low_band(low_m, false);
            ASSERT_FALSE(gave_early || gave_late) << n;
            ASSERT_TRUE(!pose || !pose->valid || std::abs(pose->x_m - kPlace_m) < 0.01) << n << ": " << pose->x_m;
            EXPECT_TRUE(n < 5 || (pose && pose->valid)) << n;
        }
    }
    EXPECT_EQ(this->subject_.tracker.counters().accepted, 2U * 30 * 3);
}

/// A fault ends tracking as late as silence does.
TYPED_TEST(TrackerContract, IsLostATenthOfASecondAfterTheLastValidPose) {
    const DeviceTime last_valid = this->track();
    DeviceTime now = last_valid;
    while (this->subject_.tracker.state() == TrackerState::tracking && now < last_valid + kSearchAfter) {
        const auto pose = this->subject_.saturated_frame(kPlace_m);
        ASSERT_FALSE(pose && pose->valid);
        now = this->subject_.now();
    }
    EXPECT_GT(now - last_valid, kLostAfter);
    EXPECT_LT(now - last_valid, kLostAfter + 2 * TypeParam::kFrame);
    EXPECT_EQ(this->subject_.tracker.state(), TrackerState::lost);
    this->run(30);
    EXPECT_EQ(this->subject_.tracker.state(), TrackerState::tracking);
    EXPECT_EQ(this->subject_.tracker.counters().acquisitions, 2U);
}

TYPED_TEST(TrackerContract, SilenceLeadsToLostThenSearching) {
    const DeviceTime last_valid = this->track();
    auto& tracker = this->subject_.tracker;
    (void)tracker.tick(last_valid + kLostAfter);
    EXPECT_EQ(tracker.state(), TrackerState::tracking);
    const auto stale = tracker.tick(last_valid + kLostAfter + Microseconds{1});
    ASSERT_TRUE(stale);
    EXPECT_TRUE(stale->flags.has(PoseFlag::stale));
    EXPECT_FALSE(stale->valid());
    EXPECT_EQ(tracker.state(), TrackerState::lost);
    EXPECT_EQ(stale->state, TrackerState::lost);
    (void)tracker.tick(last_valid + kSearchAfter);
    EXPECT_EQ(tracker.state(), TrackerState::lost);
    (void)tracker.tick(last_valid + kSearchAfter + Microseconds{1});
    EXPECT_EQ(tracker.state(), TrackerState::searching);
}

}  // namespace
}  // namespace tricoil::test

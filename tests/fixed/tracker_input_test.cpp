// Invalid blocks are refused and counted, or flagged; no undefined behaviour.
#include <gtest/gtest.h>

#include <random>

#include "core/fixed/tracker.hpp"
#include "core/signal/block_health.hpp"
#include "tests/support/integer_blocks.hpp"

namespace tricoil::fixed {
namespace {

using tracking::PoseFlag;
using tracking::TrackerState;

constexpr std::int32_t kMax = std::numeric_limits<std::int32_t>::max();
constexpr std::int32_t kMin = std::numeric_limits<std::int32_t>::min();

TrackerParams confined() {
    TrackerParams params;
    params.confined = true;
    return params;
}

class FixedTrackerInput : public testing::Test {
protected:
    FixedTrackerInput() {
        x_ << 400'000, 0, 0, 0, -200'000, 0, 0, 0, -200'000;  // straight ahead
        for (int n = 0; n < 6; ++n) {
            (void)tracker_.update(next());
        }
        EXPECT_EQ(tracker_.state(), TrackerState::tracking);
    }

    SampleBlock next() { return blocks_.next(x_); }

    /// Expects refusal for that reason, and a pose from the next good block.
    void expect_refused(const SampleBlock& block, Rejection reason) {
        const auto before = tracker_.counters();
        EXPECT_FALSE(tracker_.update(block));
        EXPECT_EQ(tracker_.counters().of(reason), before.of(reason) + 1);
        EXPECT_EQ(tracker_.counters().accepted, before.accepted);
        EXPECT_EQ(tracker_.state(), TrackerState::tracking);
    }

    test::IntegerBlocks blocks_;
    Mat3<std::int32_t> x_;
    Tracker tracker_{test::IntegerBlocks::kAcquisition, {}, confined()};
};

TEST_F(FixedTrackerInput, RefusesAndCounts) {
    const SampleBlock good = next();
    SampleBlock bad = good;
    bad.samples = bad.samples.first(100);
    expect_refused(bad, Rejection::wrong_length);
    bad.samples = {};
    expect_refused(bad, Rejection::wrong_length);
    for (const int state : {0, 4, 5, 200}) {
        bad = good;
        bad.state = static_cast<Excitation>(state);
        expect_refused(bad, Rejection::unknown_state);
    }
    bad = good;
    bad.start = device_time_us(10);
    expect_refused(bad, Rejection::time_backwards);
    for (const std::int64_t us : {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()}) {
        bad.start = device_time_us(us);
        expect_refused(bad, Rejection::bad_time);
        EXPECT_FALSE(tracker_.tick(bad.start));
    }
    bad = good;
    bad.sequence -= 1;
    expect_refused(bad, Rejection::repeated_sequence);
    EXPECT_TRUE(tracker_.update(good)->valid());
    EXPECT_EQ(tracker_.counters().lost_blocks, 0U);
    EXPECT_EQ(tracker_.counters().restarts, 0U);
}

TEST_F(FixedTrackerInput, RestartedDeviceIsFollowed) {
    for (int n = 0; n < 60; ++n) {
        (void)tracker_.update(next());
    }
    test::IntegerBlocks restarted;
    bool valid = false;
    for (int n = 0; n < Tracker::kMaxOutOfOrder + 4 + 6; ++n) {
        const auto pose = tracker_.update(restarted.next(x_));
        valid = pose && pose->valid();
    }
    EXPECT_TRUE(valid);
    EXPECT_EQ(tracker_.counters().restarts, 1U);
}

/// After a restart of the clock, the old times have no effect.
TEST_F(FixedTrackerInput, RestartedDeviceWithoutSensorGoesStale) {
    for (int n = 0; n < 600; ++n) {
        (void)tracker_.update(next());
    }
    test::IntegerBlocks restarted;
    SampleBlock block;
    for (int n = 0; n < Tracker::kMaxOutOfOrder + 4; ++n) {
        block = restarted.next(Mat3<std::int32_t>::Zero());
        (void)tracker_.update(block);
    }
    ASSERT_EQ(tracker_.counters().restarts, 1U);
    EXPECT_FALSE(tracker_.tick(block.start));
    const auto stale = tracker_.tick(block.start + Microseconds{200'000});
    ASSERT_TRUE(stale);
    EXPECT_TRUE(stale->flags.has(PoseFlag::stale));
}

/// A block refused for its length does not count in the sequence check, so it does not hide a restarted sequence.
TEST_F(FixedTrackerInput, RefusedBlocksDoNotHideANewSequence) {
    const SampleBlock good = next();
    SampleBlock repeated = good;
    repeated.sequence -= 1;
    SampleBlock cut = good;
    cut.samples = cut.samples.first(100);
    for (int n = 0; n < Tracker::kMaxOutOfOrder; ++n) {
        (void)tracker_.update(repeated);
        (void)tracker_.update(cut);
    }
    EXPECT_EQ(tracker_.counters().restarts, 0U);
    (void)tracker_.update(repeated);
    EXPECT_EQ(tracker_.counters().restarts, 1U);
}

/// After a restart the hemisphere is unknown, unless the sensor is confined.
TEST(FixedTrackerAfterRestart, NeedsTheHemisphere) {
    const Mat3<std::int32_t> x = Vec3<std::int32_t>(400'000, -200'000, -200'000).asDiagonal();
    Tracker tracker(test::IntegerBlocks::kAcquisition, {}, {});
    std::optional<PoseEstimate> pose;
    for (int begin = 0; begin < 2; ++begin) {
        test::IntegerBlocks blocks;
        for (int n = 0; n < 60; ++n) {
            pose = tracker.update(blocks.next(x));
        }
        ASSERT_TRUE(pose);
        EXPECT_EQ(pose->flags.has(PoseFlag::hemisphere_unknown), begin == 1);
    }
    EXPECT_EQ(tracker.counters().restarts, 1U);
    tracker.set_hemisphere(Vec3<Unit>(1, 0, 0));
    EXPECT_FALSE(tracker.tick(DeviceTime{}));
}

TEST_F(FixedTrackerInput, OverrunsAreNotTrusted) {
    SampleBlock block = next();
    block.overrun_count = 1;
    EXPECT_TRUE(tracker_.update(block)->flags.has(PoseFlag::unconfirmed));
}

TEST_F(FixedTrackerInput, ABlockOfZerosIsNoReference) {
    SampleBlock block = next();
    blocks_.samples().fill({});
    const auto pose = tracker_.update(block);
    ASSERT_TRUE(pose);
    EXPECT_TRUE(pose->flags.has(PoseFlag::no_reference));
    EXPECT_FALSE(pose->valid());
}

TEST_F(FixedTrackerInput, SaturatedCodesAreFlagged) {
    SampleBlock block = next();
    blocks_.samples()[100][1] = block.full_scale;
    EXPECT_TRUE(tracker_.update(block)->flags.has(PoseFlag::saturated));
}

TEST_F(FixedTrackerInput, HemisphereTurnsThePosition) {
    const auto ahead = tracker_.update(next());
    tracker_.set_hemisphere(Vec3<Unit>(-1, 0, 0));
    const auto behind = tracker_.update(next());
    EXPECT_GT(ahead->position_m.x().raw(), 0);
    EXPECT_LT(behind->position_m.x().raw(), 0);
    EXPECT_TRUE(behind->valid());
}

TEST_F(FixedTrackerInput, PosesAfterALostOrRefusedBlockAreFlagged) {
    int poses = 0;
    int flagged = 0;
    const auto see_twelve_blocks = [&] {
        poses = flagged = 0;
        for (int n = 0; n < 12; ++n) {
            const auto pose = tracker_.update(next());
            poses += pose ? 1 : 0;
            flagged += pose && pose->flags.has(PoseFlag::columns_missing) ? 1 : 0;
        }
    };
    see_twelve_blocks();
    EXPECT_EQ(poses, 12);
    EXPECT_EQ(flagged, 0);
    (void)next();  // lost
    see_twelve_blocks();
    EXPECT_EQ(poses, 10) << "the first pose after a gap needs three columns";
    EXPECT_EQ(flagged, 4);
    SampleBlock bad = next();
    bad.samples = {};
    EXPECT_FALSE(tracker_.update(bad));
    see_twelve_blocks();
    EXPECT_EQ(poses, 10);
    EXPECT_EQ(flagged, 4);
}

/// Random codes of all magnitudes in all channels: poses, flagged or not, have unit quaternions, and later good blocks give good
/// poses.
TEST_F(FixedTrackerInput, SurvivesAnyCodes) {
    std::mt19937_64 random(61);
    for (int n = 0; n < 600; ++n) {
        SampleBlock block = next();
        const auto bits = static_cast<int>(random() % 32);
        for (Sample& sample : blocks_.samples()) {
            for (std::int32_t& code : sample) {
                const bool end = random() % 4 == 0 && n % 2 == 0;
                code = end ? (random() % 2 == 0 ? kMax : kMin)
                           : static_cast<std::int32_t>(static_cast<std::uint32_t>(random())) >> bits;
            }
        }
        block.full_scale = n % 3 == 0 ? 0 : (n % 3 == 1 ? kMax : kMin);
        const auto pose = tracker_.update(block);
        ASSERT_TRUE(!pose || pose->q_source_sensor.w.raw() != kMin);
    }
    bool valid = false;
    for (int n = 0; n < 200; ++n) {
        const auto pose = tracker_.update(next());
        valid = pose && pose->valid();
    }
    EXPECT_TRUE(valid);
}

TEST(FixedParameters, AreChecked) {
    EXPECT_TRUE(check(TrackerParams{}).ok());
    const auto refused = [](auto&& change) {
        TrackerParams params;
        change(params);
        return check(params).code() == StatusCode::invalid_argument;
    };
    EXPECT_TRUE(refused([](auto& p) { p.coupling_constant = {}; }));
    EXPECT_TRUE(refused([](auto& p) { p.passes = 0; }));
    EXPECT_TRUE(refused([](auto& p) { p.min_snr = 0; }));
    EXPECT_TRUE(refused([](auto& p) { p.max_misfit = Unit(0); }));
    EXPECT_TRUE(refused([](auto& p) { p.search_after = Microseconds{1}; }));
    EXPECT_TRUE(check(Acquisition{}).ok());
    Acquisition acquisition = test::IntegerBlocks::kAcquisition;
    EXPECT_TRUE(check(acquisition).ok());
    acquisition.window_cycles[0] = 80;
    EXPECT_FALSE(check(acquisition).ok());
    acquisition = test::IntegerBlocks::kAcquisition;
    acquisition.guard_samples = 190;
    EXPECT_FALSE(check(acquisition).ok());
}

TEST(FixedParameters, OfTheDemodulatorAreChecked) {
    EXPECT_TRUE(check(DemodulatorParams{}).ok());
    const auto refused = [](auto&& change) {
        DemodulatorParams params;
        change(params);
        return check(params).code() == StatusCode::invalid_argument;
    };
    EXPECT_TRUE(refused([](auto& p) { p.corrections[2][1].exponent = kMin; }));
    EXPECT_TRUE(refused([](auto& p) { p.corrections[0][0].re = Unit::smallest(); }));
    EXPECT_TRUE(refused([](auto& p) { p.corrections[1][2].im = Unit::from(1.001); }));
    EXPECT_TRUE(refused([](auto& p) { p.least_reference = 0; }));
    EXPECT_TRUE(refused([](auto& p) { p.least_reference = kMax; }));
    EXPECT_TRUE(refused([](auto& p) { p.low_signal_ratio = 0; }));
    EXPECT_TRUE(refused([](auto& p) { p.linear_share = Unit(0); }));
    EXPECT_TRUE(refused([](auto& p) { p.noise_shift = 17; }));
    EXPECT_TRUE(refused([](auto& p) { p.noise_jump = 0; }));
}

/// Unchecked parameters may give wrong couplings, but no undefined behaviour.
TEST(FixedParameters, UncheckedOnesDoNoHarm) {
    for (const int exponent : {kMin, kMax}) {
        DemodulatorParams params;
        params.corrections[0][0] = {Unit::smallest(), Unit::smallest(), exponent};
        Tracker tracker(Acquisition{}, params, {});
        test::IntegerBlocks blocks;
        for (int n = 0; n < 6; ++n) {
            (void)tracker.update(blocks.next(Mat3<std::int32_t>::Constant(-400'000)));
        }
        EXPECT_EQ(tracker.counters().accepted, 6U);
    }
    const std::array still{0};
    EXPECT_EQ(signal::longest_natural_run(still, 160), signal::longest_natural_run(std::array{1}, 160));
}

TEST(FixedParameters, PlansOfUnfitRatesAreRefused) {
    auto plan = *signal::plan_acquisition(signal::default_acquisition(signal::Multiplexing::tdm, 240));
    EXPECT_TRUE(acquisition_of(plan).ok());
    for (const double rate_hz : {144'000.5, 0.0, -1.0, 3e9, std::numeric_limits<double>::quiet_NaN()}) {
        plan.params.sample_rate_hz = rate_hz;
        EXPECT_EQ(acquisition_of(plan).status().code(), StatusCode::invalid_argument) << rate_hz;
    }
}

}  // namespace
}  // namespace tricoil::fixed

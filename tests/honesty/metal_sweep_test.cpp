// Valid poses near metal agree with their covariance: 2,000 random objects per mode.
#include <gtest/gtest.h>

#include "tests/honesty/metal_sweep.hpp"

namespace tricoil::test {
namespace {

constexpr std::uint64_t kSweepCases = 2000;

class MetalSweepTest : public ::testing::TestWithParam<signal::Multiplexing> {};

TEST_P(MetalSweepTest, ValidPosesAreHonest) {
    constexpr double kMaxError_m = 0.05;
    const MetalSweep sweep = sweep_metal(GetParam(), 1, kSweepCases);
    print(sweep, name_of(GetParam()));
    for (const MetalSweep::Tracker& tracker : sweep.trackers) {
        const double max_beyond =
            tracker.method == Method::dual_band ? 0.001 : 0.01;  // most of it: errors within the low band's noise
        const PoseRow& row = tracker.all;
        EXPECT_LE(row.beyond_share(), max_beyond) << name_of(tracker.method);
        EXPECT_EQ(row.above_limit, 0U) << name_of(tracker.method);
        EXPECT_LT(row.max_m(), kMaxError_m) << name_of(tracker.method) << ", seed " << tracker.worst_seed;
        EXPECT_GT(row.valid, row.poses * 9 / 10) << name_of(tracker.method);
        EXPECT_GE(row.shown_quantile(0.05), 0.5) << name_of(tracker.method) << ": 95 % of errors below twice the distortion";
        EXPECT_GE(row.shown_quantile(0.5), 1) << name_of(tracker.method);
        EXPECT_LE(row.shown_quantile(0.5), tracker.method == Method::dual_band ? 2.2 : 2) << name_of(tracker.method);
    }
    EXPECT_TRUE(sweep.late.empty()) << "seed " << sweep.late.front();
}

INSTANTIATE_TEST_SUITE_P(Mode, MetalSweepTest, ::testing::ValuesIn(kSweepModes),
                         [](const auto& mode) { return name_of(mode.param); });

}  // namespace
}  // namespace tricoil::test

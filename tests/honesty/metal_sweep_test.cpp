// Valid poses near metal agree with their covariance, with one band: 2,000 random objects per multiplexing.
#include <gtest/gtest.h>

#include "tests/honesty/metal_sweep.hpp"

namespace tricoil::test {
namespace {

constexpr std::uint64_t kSweepCases = 2000;

class MetalSweepTest : public ::testing::TestWithParam<signal::Multiplexing> {};

TEST_P(MetalSweepTest, ValidPosesAreHonest) {
    constexpr double kMaxBeyond = 0.01;
    constexpr double kMaxError_m = 0.05;
    const MetalSweep sweep = sweep_metal(GetParam(), 1, kSweepCases);
    print(sweep, name_of(GetParam()));
    for (std::size_t n = 0; n < kMethods.size(); ++n) {
        const PoseRow& row = sweep.trackers[n].all;
        EXPECT_LE(row.beyond_share(), kMaxBeyond) << name_of(kMethods[n]);
        EXPECT_EQ(row.above_limit, 0U) << name_of(kMethods[n]);
        EXPECT_LT(row.max_m(), kMaxError_m) << name_of(kMethods[n]) << ", seed " << sweep.trackers[n].worst_seed;
        EXPECT_GT(row.valid, row.poses * 9 / 10) << name_of(kMethods[n]);
    }
    EXPECT_TRUE(sweep.late.empty()) << "seed " << sweep.late.front();
}

INSTANTIATE_TEST_SUITE_P(Multiplexing, MetalSweepTest, ::testing::Values(signal::Multiplexing::tdm, signal::Multiplexing::fdm),
                         [](const auto& mode) { return name_of(mode.param); });

}  // namespace
}  // namespace tricoil::test

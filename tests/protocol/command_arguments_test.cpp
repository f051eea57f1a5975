#include "core/protocol/command_arguments.hpp"

#include <gtest/gtest.h>

namespace tricoil::protocol {
namespace {

TEST(ModeArgument, RoundTrips) {
    for (const auto multiplexing : {signal::Multiplexing::tdm, signal::Multiplexing::fdm, signal::Multiplexing::dual_band}) {
        for (const bool columns : {false, true}) {
            for (const std::uint32_t rate : {0U, 240'000U, 100'000'000U, kModeRateMask}) {
                ModeRequest mode;
                ASSERT_TRUE(mode_of_argument(mode_argument({rate, multiplexing, columns}), mode));
                EXPECT_EQ(mode.frame_rate_millihertz, rate);
                EXPECT_EQ(mode.multiplexing, multiplexing);
                EXPECT_EQ(mode.columns, columns);
            }
        }
    }
}

TEST(ModeArgument, RefusesUnusedBits) {
    ModeRequest mode;
    EXPECT_FALSE(mode_of_argument(kModeFdmBit | kModeDualBandBit, mode));
    EXPECT_FALSE(mode_of_argument(1U << 31U, mode));
}

TEST(HemisphereArgument, KeepsTheDirection) {
    const Vec3<float> towards(-0.3F, 2, 0.5F);
    const auto got = hemisphere_of_argument(hemisphere_argument({2, towards}));
    EXPECT_EQ(got.sensor, 2);
    EXPECT_GT(got.towards.normalized().dot(towards.normalized()), 0.9999F);
}

TEST(HemisphereArgument, ZeroAndInvalidDirectionsAreUnknown) {
    EXPECT_EQ(hemisphere_argument({0, Vec3<float>::Zero()}), 0U);
    EXPECT_EQ(hemisphere_argument({0, Vec3<float>(std::nanf(""), 1, 0)}), 0U);
    EXPECT_TRUE(hemisphere_of_argument(0).towards.isZero(0));
}

}  // namespace
}  // namespace tricoil::protocol

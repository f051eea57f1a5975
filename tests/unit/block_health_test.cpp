#include "core/signal/block_health.hpp"

#include <gtest/gtest.h>

#include "tests/support/tones.hpp"

namespace tricoil::signal {
namespace {

TEST(BlockHealth, UnknownFullScaleMeansNoSaturationAndNoOffset) {
    const auto plan = *plan_acquisition(default_acquisition(Multiplexing::tdm, 240));
    test::ToneBlock block;
    block.offset.fill(2e9);
    for (auto& channel : block.tones) {
        channel[0] = {1e6, 0};
    }
    std::mt19937_64 random(5);
    const auto samples = test::render(block, plan, random);
    EXPECT_TRUE(inspect_window(samples, plan, 0, 0.25F).empty());
}

TEST(BlockHealth, AStuckReferenceDoesNotFlagTheSensor) {
    const auto plan = *plan_acquisition(default_acquisition(Multiplexing::tdm, 240));
    test::ToneBlock block;
    for (std::size_t c = 0; c < 3; ++c) {
        block.tones[c][0] = {1e6, 0};
    }
    std::mt19937_64 random(6);
    const auto samples = test::render(block, plan, random);
    EXPECT_FALSE(inspect_window(samples, plan, 8388607, 0.25F).has(ColumnFlag::stuck));
}

}  // namespace
}  // namespace tricoil::signal

#include "core/signal/block_health.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/tones.hpp"

namespace tricoil::signal {
namespace {

ColumnFlags flags_of(const std::vector<Sample>& window, const AcquisitionPlan& plan, std::int32_t linear_range) {
    return inspect_window(window, longest_natural_run(plan.high_cycles(), plan.window_samples), linear_range);
}

TEST(BlockHealth, UnknownFullScaleMeansNoSaturationAndNoOffset) {
    const auto plan = *plan_acquisition(default_acquisition(Multiplexing::tdm, 240));
    test::ToneBlock block;
    block.offset.fill(2e9);
    for (auto& channel : block.tones) {
        channel[0] = {1e6, 0};
    }
    std::mt19937_64 random(5);
    const auto samples = test::render(block, plan, random);
    EXPECT_TRUE(flags_of(samples, plan, 0).empty());
}

TEST(BlockHealth, AStuckReferenceDoesNotFlagTheSensor) {
    const auto plan = *plan_acquisition(default_acquisition(Multiplexing::tdm, 240));
    test::ToneBlock block;
    for (std::size_t c = 0; c < 3; ++c) {
        block.tones[c][0] = {1e6, 0};
    }
    std::mt19937_64 random(6);
    const auto samples = test::render(block, plan, random);
    EXPECT_FALSE(flags_of(samples, plan, 8388607).has(ColumnFlag::stuck));
}

TEST(SampleBlock, MidpointLiesBetweenTheFirstAndTheLastSample) {
    const std::array<Sample, 200> samples{};
    SampleBlock block;
    block.start = device_time_us(1'000);
    block.samples = samples;
    EXPECT_EQ(to_us(midpoint(block, 144'000'000)), 1'691);  // 99.5 samples of 6.944 us: 690.97
    block.samples = std::span(samples).first(1);
    EXPECT_EQ(to_us(midpoint(block, 144'000'000)), 1'000);
    EXPECT_EQ(to_us(midpoint(block, 0)), 1'000);
}

/// The limit for flat tops is that of the slowest carrier: FDM samples with the slowest carrier alone (near a source coil) are
/// not clipped, with cut peaks they are.
TEST(BlockHealth, TheSlowestCarrierAloneIsNotClipped) {
    AcquisitionParams params = default_acquisition(Multiplexing::fdm, 240);
    params.carrier_hz = {9'600, 960, 12'000};
    const auto plan = *plan_acquisition(params);
    const auto slowest =
        std::min_element(plan.window_cycles.begin(), plan.window_cycles.begin() + plan.carriers()) - plan.window_cycles.begin();
    const auto fastest = *std::max_element(plan.window_cycles.begin(), plan.window_cycles.end());
    ASSERT_LT(plan.window_cycles[static_cast<std::size_t>(slowest)], fastest);
    test::ToneBlock block;
    for (auto& channel : block.tones) {
        channel[static_cast<std::size_t>(slowest)] = {1e6, 0.3};
    }
    std::mt19937_64 random(7);
    auto samples = test::render(block, plan, random);
    EXPECT_FALSE(flags_of(samples, plan, 8388607).has(ColumnFlag::clipped));
    for (Sample& sample : samples) {
        for (std::int32_t& code : sample) {
            code = std::clamp(code, -800'000, 800'000);
        }
    }
    EXPECT_TRUE(flags_of(samples, plan, 8388607).has(ColumnFlag::clipped));
}

}  // namespace
}  // namespace tricoil::signal

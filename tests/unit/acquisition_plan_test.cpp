#include "core/signal/acquisition_plan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace tricoil::signal {
namespace {

using ::testing::HasSubstr;

AcquisitionParams tdm() { return default_acquisition(Multiplexing::tdm, 240); }
AcquisitionParams fdm() { return default_acquisition(Multiplexing::fdm, 240); }
AcquisitionParams dual_band() { return default_acquisition(Multiplexing::dual_band, 240); }

TEST(AcquisitionPlan, DefaultsAreValidAtTheUsualRates) {
    for (const double rate : {60.0, 120.0, 240.0, 480.0}) {
        const auto plan = plan_acquisition(default_acquisition(Multiplexing::tdm, rate));
        ASSERT_TRUE(plan.ok()) << rate << ": " << plan.status().message();
        EXPECT_NEAR(plan->block_samples * 3 * rate, 144e3, 1e-6);
    }
    for (const double rate : {160.0, 240.0, 480.0, 960.0}) {
        const auto plan = plan_acquisition(default_acquisition(Multiplexing::fdm, rate));
        ASSERT_TRUE(plan.ok()) << rate << ": " << plan.status().message();
        EXPECT_EQ(plan->window_samples, plan->block_samples);
    }
}

TEST(AcquisitionPlan, TdmDefaultHasTheSamePhaseInEveryBlock) {
    const auto plan = plan_acquisition(tdm());
    EXPECT_EQ(plan->block_samples, 200);
    EXPECT_EQ(plan->window_samples, 160);
    const double cycles_per_block = plan->params.carrier_hz[0] * plan->block_s();
    EXPECT_NEAR(cycles_per_block, std::round(cycles_per_block), 1e-9);
}

TEST(AcquisitionPlan, LowBandHasWholeCyclesInTheSameWindow) {
    for (const double rate : {160.0, 200.0, 240.0}) {
        const auto plan = plan_acquisition(default_acquisition(Multiplexing::dual_band, rate));
        ASSERT_TRUE(plan.ok()) << rate << ": " << plan.status().message();
        EXPECT_TRUE(plan->has_low_band());
        EXPECT_EQ(plan->carriers(), 6);
        for (std::size_t j = 3; j < 6; ++j) {
            EXPECT_NEAR(plan->params.carrier_hz[j], plan->window_cycles[j] * rate, 1e-6);
            EXPECT_GT(plan->params.carrier_hz[j], 300);
            EXPECT_LT(plan->params.carrier_hz[j], 1100);
        }
    }
    EXPECT_EQ(plan_acquisition(dual_band())->window_cycles, (std::array{32, 42, 56, 2, 3, 4}));
    EXPECT_FALSE(plan_acquisition(fdm())->has_low_band());
}

struct Refusal {
    const char* message;
    AcquisitionParams params;
};

AcquisitionParams changed(AcquisitionParams params, void (*change)(AcquisitionParams&)) {
    change(params);
    return params;
}

TEST(AcquisitionPlan, NamesEachInvalidParameter) {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    const Refusal refusals[] = {
        {"sample rate must be", changed(tdm(), [](auto& p) { p.sample_rate_hz = 0; })},
        {"sample rate must be", changed(tdm(), [](auto& p) { p.sample_rate_hz = kNan; })},
        {"frame rate must be", changed(tdm(), [](auto& p) { p.frame_rate_hz = -240; })},
        {"frame rate must be", changed(tdm(), [](auto& p) { p.frame_rate_hz = std::numeric_limits<double>::infinity(); })},
        {"whole number of samples", changed(tdm(), [](auto& p) { p.frame_rate_hz = 241; })},
        {"whole number of samples", changed(fdm(), [](auto& p) { p.frame_rate_hz = 1e9; })},
        {"1024 samples", changed(fdm(), [](auto& p) { p.frame_rate_hz = 1; })},
        {"guard must be", changed(tdm(), [](auto& p) { p.guard_samples = 200; })},
        {"guard must be", changed(tdm(), [](auto& p) { p.guard_samples = -1; })},
        {"carrier frequency must be", changed(tdm(), [](auto& p) { p.carrier_hz[0] = kNan; })},
        {"Nyquist", changed(tdm(), [](auto& p) { p.carrier_hz[0] = 70e3; })},
        {"whole cycles", changed(tdm(), [](auto& p) { p.carrier_hz[0] = 10'123; })},
        {"four carrier cycles", changed(tdm(), [](auto& p) { p.carrier_hz[0] = 900; })},
        {"choose dual-band", changed(dual_band(), [](auto& p) { p.multiplexing = Multiplexing::fdm; })},
        {"fewer than two cycles", default_acquisition(Multiplexing::dual_band, 480)},
        {"carrier frequency must be", changed(dual_band(), [](auto& p) { p.carrier_hz[4] = 0; })},
        {"whole cycles", changed(dual_band(), [](auto& p) { p.carrier_hz[4] = 700; })},
        {"equal cycles", changed(dual_band(), [](auto& p) { p.carrier_hz[4] = p.carrier_hz[3]; })},
        {"below all high carriers", changed(dual_band(), [](auto& p) { p.carrier_hz[5] = p.carrier_hz[0]; })},
        {"closer than two cycles", changed(fdm(), [](auto& p) { p.carrier_hz[1] = p.carrier_hz[0] + 240; })},
    };
    for (const Refusal& refusal : refusals) {
        const auto plan = plan_acquisition(refusal.params);
        ASSERT_FALSE(plan.ok()) << refusal.message;
        EXPECT_THAT(plan.status().message(), HasSubstr(refusal.message));
        EXPECT_EQ(plan.status().code(), StatusCode::invalid_argument);
    }
}

TEST(AcquisitionPlan, RefusesTdmAt960Hertz) {
    const auto plan = plan_acquisition(default_acquisition(Multiplexing::tdm, 960));
    EXPECT_THAT(plan.status().message(), HasSubstr("use FDM"));
}

}  // namespace
}  // namespace tricoil::signal

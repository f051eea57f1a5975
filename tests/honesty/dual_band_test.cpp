// Two bands, from samples through the demodulator: clean runs, and metal at rest and in motion.
#include <gtest/gtest.h>

#include "tests/honesty/replay_columns.hpp"

namespace tricoil::test {
namespace {

double rms(const PoseRow& row) {
    double squares = 0;
    for (const double e : row.error_m) {
        squares += e * e;
    }
    return std::sqrt(squares / static_cast<double>(std::max<std::size_t>(row.error_m.size(), 1)));
}

RunSettings dual_band(const char* scenario, double duration_s, std::uint64_t seed = 1) {
    return {scenario, signal::Multiplexing::dual_band, true, {}, duration_s, seed};
}

TEST(DualBand, CleanRunIsNotDistorted) {
    constexpr std::uint64_t kRuns = 10;
    constexpr double kFirstComparison_s = 0.11;
    PoseRow::print_header();
    for (const char* scenario : {"hand", "circle", "still"}) {
        for (const bool noise : {true, false}) {
            PoseRow row;
            PoseRow direct;
            for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
                RunSettings settings = dual_band(scenario, 3, seed);
                settings.noise = noise;
                const auto run = simulate_columns(settings);
                row.add(replay_columns(run, Method::dual_band, {}, kFirstComparison_s));
                direct.add(replay_columns(run, Method::direct, {}, kFirstComparison_s));
            }
            const std::string name = std::string(scenario) + (noise ? "" : " without noise");
            row.print(name);
            direct.print("  high band alone");
            EXPECT_LE(row.distorted_share(), 1e-3) << name;
            EXPECT_LE(row.beyond_share(), 1e-3) << name;
            EXPECT_EQ(row.valid, row.poses) << name;
        }
    }
}

struct MetalAtRest {
    const char* name;
    const char* fault;
    double least_gain;  // error of the high band alone relative to that with both bands
};

class DualBandMetal : public ::testing::TestWithParam<MetalAtRest> {};

/// The metal is there from the beginning; the sensor rests. Errors after one second.
TEST_P(DualBandMetal, RemovesTheErrorOfMetal) {
    RunSettings settings = dual_band("still", 4);
    settings.faults = {GetParam().fault};
    const auto run = simulate_columns(settings);
    const PoseRow high = replay_columns(run, Method::direct, {}, 1);
    const PoseRow both = replay_columns(run, Method::dual_band, {}, 1);
    PoseRow::print_header();
    high.print(std::string(GetParam().name) + ", high band");
    both.print(std::string(GetParam().name) + ", two bands");
    EXPECT_LT(rms(both), rms(high) / GetParam().least_gain);
    EXPECT_LE(both.beyond_share(), 1e-3);
}

INSTANTIATE_TEST_SUITE_P(
    Metal, DualBandMetal,
    ::testing::Values(
        // Its effect in the low band is 0.8 of that in the high band.
        MetalAtRest{
            "aluminium_sheet",
            "metal:sheet,material=aluminium,width_m=0.15,height_m=0.15,thickness_m=0.0013,position_m=0.25/0.15/0,axis=0/1/0", 10},
        MetalAtRest{"copper_sphere", "metal:sphere,material=copper,radius_m=0.02,position_m=0.25/0.1/0", 1},
        MetalAtRest{"titanium_rod", "metal:rod,material=titanium,diameter_m=0.03,length_m=0.15,position_m=0.3/0.09/0", 15},
        MetalAtRest{"steel_304_rod", "metal:rod,material=304,diameter_m=0.03,length_m=0.15,position_m=0.3/0.09/0", 15},
        // The bands differ more in the misfit than in the pose.
        MetalAtRest{"steel_416_rod", "metal:rod,material=416,diameter_m=0.03,length_m=0.15,position_m=0.3/0.09/0", 1},
        MetalAtRest{"low_carbon_steel_rod", "metal:rod,material=steel,diameter_m=0.03,length_m=0.15,position_m=0.3/0.09/0", 1.5},
        // The tracker does not improve it.
        MetalAtRest{
            "low_carbon_steel_sheet",
            "metal:sheet,material=steel,width_m=0.1262,height_m=0.1262,thickness_m=0.0013,position_m=0.0445/0.0740/0.1046,"
            "axis=0.860/0.040/0.509",
            0.9}),
    [](const auto& metal) { return metal.param.name; });

}  // namespace
}  // namespace tricoil::test

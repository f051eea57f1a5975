// Runs without metal and faults: at most one of 1,000 poses has the flag `distorted`, and at most one of 1,000 valid poses is
// beyond five of its standard deviations.
#include <gtest/gtest.h>

#include "tests/honesty/replay_columns.hpp"

namespace tricoil::test {
namespace {

constexpr int kSeeds = 10;
constexpr double kDuration_s = 3;

PoseRow clean_row(const char* scenario, signal::Multiplexing mode, bool noise, Method method) {
    PoseRow row;
    for (int seed = 1; seed <= kSeeds; ++seed) {
        const auto run = simulate_columns({scenario, mode, noise, {}, kDuration_s, static_cast<std::uint64_t>(seed)});
        row.add(replay_columns(run, method));
    }
    return row;
}

TEST(CleanRun, IsNotDistorted) {
    PoseRow::print_header();
    for (const char* scenario : {"hand", "circle", "still"}) {
        for (const auto mode : {signal::Multiplexing::tdm, signal::Multiplexing::fdm}) {
            for (const bool noise : {true, false}) {
                for (const Method method : kMethods) {
                    const PoseRow row = clean_row(scenario, mode, noise, method);
                    const std::string name =
                        std::string(scenario) + " " + name_of(mode) + " " + name_of(method) + (noise ? "" : " without noise");
                    row.print(name);
                    EXPECT_LE(row.distorted_share(), 1e-3) << name;
                    if (noise) {
                        EXPECT_LE(row.beyond_share(), 1e-3) << name;
                    }
                }
            }
        }
    }
}

}  // namespace
}  // namespace tricoil::test

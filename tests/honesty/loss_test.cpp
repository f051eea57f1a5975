// Lost columns and faults: at most one of 1,000 valid poses is beyond five of its standard deviations. The first
// poses are included.
#include <gtest/gtest.h>

#include "tests/honesty/replay_columns.hpp"

namespace tricoil::test {
namespace {

const std::vector<std::string> kFaults{"",
                                       "unplugged@1-1.5",
                                       "swapped_coils:C1,C2@1-1.5",
                                       "swapped_coils:S1,S3@1-1.5",
                                       "open_coil:S2@1-1.5",
                                       "reversed_coil:C1@1-1.5",
                                       "reversed_coil:S3@1-1.5",
                                       "stuck_channel:C2@1-1.5",
                                       "stuck_channel:R@1-1.5",
                                       "overload:0.5@1-1.5",
                                       "broken_stage:S1@1-1.5"};
constexpr std::array<Loss, 7> kLosses{{{0, 1}, {0.01, 1}, {0.01, 4}, {0.05, 1}, {0.05, 4}, {0.2, 1}, {0.2, 4}}};
constexpr double kLossDuration_s = 2.5;

/// All runs of one multiplexing.
std::vector<SimulatedColumns> runs_of(signal::Multiplexing mode) {
    std::vector<SimulatedColumns> runs;
    std::uint64_t seed = 1;
    for (const std::string& fault : kFaults) {
        for (const char* scenario : {"hand", "circle"}) {
            const auto faults = fault.empty() ? std::vector<std::string>{} : std::vector<std::string>{fault};
            runs.push_back(simulate_columns({scenario, mode, true, faults, kLossDuration_s, seed++}));
        }
    }
    return runs;
}

class LossAndFaults : public ::testing::TestWithParam<signal::Multiplexing> {};

TEST_P(LossAndFaults, LeaveValidPosesHonest) {
    const auto runs = runs_of(GetParam());
    PoseRow::print_header();
    for (const Method method : kMethods) {
        for (const Loss loss : kLosses) {
            PoseRow row;
            for (const SimulatedColumns& run : runs) {
                row.add(replay_columns(run, method, loss));
            }
            const std::string name = std::string(name_of(GetParam())) + " " + name_of(method) + ", " +
                                     std::to_string(static_cast<int>(100 * loss.share)) + " % lost in bursts of " +
                                     std::to_string(loss.burst);
            row.print(name);
            EXPECT_LE(row.beyond_share(), 1e-3) << name;
            EXPECT_EQ(row.above_limit, 0U) << name;
            EXPECT_GT(row.valid, row.poses / 5) << name;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Multiplexing, LossAndFaults, ::testing::Values(signal::Multiplexing::tdm, signal::Multiplexing::fdm),
                         [](const auto& mode) { return name_of(mode.param); });

}  // namespace
}  // namespace tricoil::test

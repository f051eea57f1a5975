// Two bands from the command line: run, record, replay, refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;

constexpr const char* kTitanium = " --fault metal:rod,material=titanium,diameter_m=0.03,length_m=0.15,position_m=0.3/0.09/0";

nlohmann::json run(const std::string& arguments) {
    const CliResult result = tricoil("run --json --mux dual-band --duration 3 " + arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.json();
}

TEST(DualBand, RunKeepsTheAccuracyOfTheHighBandAndRemovesMetal) {
    const auto clean = run("--tracker dual-band");
    EXPECT_LT(clean["position_rms_m"].get<double>(), 1.2 * clean["bound_position_rms_m"].get<double>());
    EXPECT_EQ(clean["poses_invalid"], 0);
    const auto high = run(std::string("--scenario still --tracker direct") + kTitanium);
    const auto both = run(std::string("--scenario still --tracker dual-band") + kTitanium);
    EXPECT_LT(both["position_rms_m"].get<double>(), high["position_rms_m"].get<double>() / 5);
}

TEST(DualBand, ARecordingReplaysBitForBit) {
    const auto record = [](const std::string& tracker) {
        const std::string take = path_in_temp("dual_band_take_" + tracker);
        std::filesystem::remove_all(take);
        run("--tracker " + tracker + " --record " + take + kTitanium);
        const CliResult same = tricoil("replay " + take);
        EXPECT_EQ(same.exit_code, 0) << same.out << same.err;
        return take;
    };
    const std::string poses = path_in_temp("dual_band_poses.csv");
    const std::string take = record("dual-band");
    EXPECT_EQ(tricoil("replay " + take + " --tracker direct --out " + poses).exit_code, 0);
    EXPECT_EQ(read_file(poses),
              read_file(record("direct") + "/poses.csv"));  // the low band does not change a tracker of one band
}

TEST(DualBand, UnsuitableOptionsAreRefused) {
    const std::string take = path_in_temp("one_band_take");
    std::filesystem::remove_all(take);
    ASSERT_EQ(tricoil("run --duration 0.5 --record " + take).exit_code, 0);
    const struct {
        std::string command;
        const char* message;
    } refusals[] = {
        {"run --mux fdm --tracker dual-band", "--tracker dual-band: needs two bands; use --mux dual-band"},
        {"run --mux dual-band --rate-hz 144 --tracker dual-band", "use a frame rate that is a multiple of 10 Hz"},
        {"run --mux dual-band --rate-hz 480", "fewer than two cycles of a low carrier per window"},
        {"run --mux dual-band --tracker fixed-direct", "integer trackers use one band"},
        {"run --device can:none --tracker dual-band", "front ends measure one band"},
        {"replay " + take + " --tracker dual-band", "the recording was not made with it"},
    };
    for (const auto& [command, message] : refusals) {
        const CliResult result = tricoil(command);
        EXPECT_EQ(result.exit_code, 2) << command << result.err;
        EXPECT_THAT(result.err, HasSubstr(message)) << command;
    }
}

}  // namespace
}  // namespace tricoil::test

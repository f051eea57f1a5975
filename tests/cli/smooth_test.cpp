#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/cli/cli_runner.hpp"
#include "tests/support/csv_table.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;

TEST(Smooth, WritesPosesWithCovarianceAndRates) {
    const std::string take = path_in_temp("smooth_take");
    std::filesystem::remove_all(take);
    const std::string out = path_in_temp("smooth.csv");
    ASSERT_EQ(tricoil("run --mux tdm --tracker direct --duration 2 --record " + take).exit_code, 0);
    const auto result = tricoil("smooth --json " + take + " --out " + out);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const CsvTable poses(read_file(out));
    EXPECT_EQ(result.json()["poses"].get<std::size_t>(), poses.rows());
    EXPECT_GT(result.json()["poses_valid"].get<int>(), 1400);
    const std::size_t row = poses.rows() / 2;
    EXPECT_GT(poses.number(row, "cov_xx"), 0);
    EXPECT_GT(std::abs(poses.number(row, "vx_m_s")) + std::abs(poses.number(row, "wz_rad_s")), 0);
}

TEST(Smooth, RunPrintsBoth) {
    const auto result = tricoil("run --json --mux tdm --tracker scaat --duration 4 --smooth");
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_LT(result.json()["smoothed_position_rms_m"].get<double>(), 0.7 * result.json()["position_rms_m"].get<double>());
    EXPECT_TRUE(tricoil("run --json --duration 1").json()["smoothed_position_rms_m"].is_null());
    EXPECT_THAT(tricoil("run --duration 1 --smooth").out, HasSubstr("smoothed     RMS"));
}

/// The smoother gets poses from which metal has been removed.
TEST(Smooth, TwoBandsStayFreeOfMetal) {
    const std::string metal =
        "--fidelity columns --mux dual-band --tracker dual-band --fault "
        "metal:rod,material=304,diameter_m=0.03,length_m=0.15,position_m=0.3/0.09/0 ";
    for (const std::string scenario : {"still", "hand"}) {
        const auto json = tricoil("run --json --smooth --duration 2 --scenario " + scenario + " " + metal).json();
        EXPECT_LT(json["smoothed_position_rms_m"].get<double>(), json["position_rms_m"].get<double>()) << scenario;
        EXPECT_LT(json["smoothed_orientation_rms_deg"].get<double>(), json["orientation_rms_deg"].get<double>()) << scenario;
    }
    const std::string take = path_in_temp("smooth_two_bands");
    std::filesystem::remove_all(take);
    const auto live = tricoil("run --json --smooth --duration 2 --scenario still " + metal + "--record " + take).json();
    const auto result = tricoil("smooth --json " + take + " --out " + take + ".csv");
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_GT(result.json()["position_std_m"].get<double>(), 0.3 * live["smoothed_position_rms_m"].get<double>());
}

/// Frames with a fault do not reach the filter.
TEST(Smooth, AFaultOfTwoBandsEndsAnInterval) {
    const std::string take = path_in_temp("smooth_fault");
    std::filesystem::remove_all(take);
    ASSERT_EQ(
        tricoil("run --duration 1 --fidelity columns --mux dual-band --tracker dual-band --fault open_coil:S2@0.5-0.52 --out " +
                take + ".csv --record " + take)
            .exit_code,
        0);
    ASSERT_EQ(tricoil("smooth " + take + " --out " + take + ".smooth.csv").exit_code, 0);
    const CsvTable live(read_file(take + ".csv"));
    const CsvTable smoothed(read_file(take + ".smooth.csv"));
    ASSERT_EQ(live.rows(), smoothed.rows());
    int faults = 0;
    for (std::size_t row = 0; row < live.rows(); ++row) {
        if (live.text(row, "flag_names").find("no_reference") != std::string::npos) {
            ++faults;
            EXPECT_EQ(smoothed.text(row, "x_m"), "") << row;
            EXPECT_EQ(smoothed.text(row, "cov_xx"), "") << row;
        } else {
            EXPECT_GE(smoothed.number(row, "cov_xx"), 0) << row;
        }
    }
    EXPECT_GT(faults, 2);
}

TEST(Smooth, BadInputIsRefusedInOneLine) {
    const std::string take = path_in_temp("smooth_short");
    std::filesystem::remove_all(take);
    ASSERT_EQ(tricoil("run --duration 0.005 --record " + take).exit_code, 0);
    const std::string out = path_in_temp("never.csv");
    for (const auto& [options, message] :
         {std::pair<std::string, std::string>{"smooth " + take + " --out " + out, "at least two are needed"},
          {"smooth " + take + "_missing --out " + out, "smooth_short_missing"},
          {"smooth " + take, "--out is required"},
          {"smooth " + take + " --out " + take + "/poses.csv", "poses.csv"},
          {"run --smooth --tracker fixed-direct", "--smooth: not with --tracker fixed-direct"}}) {
        const auto result = tricoil(options);
        EXPECT_EQ(result.exit_code, 2) << options;
        EXPECT_THAT(result.err, HasSubstr(message));
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }
    EXPECT_FALSE(std::filesystem::exists(out));
}

}  // namespace
}  // namespace tricoil::test

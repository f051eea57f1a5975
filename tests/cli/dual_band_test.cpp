// Two bands from the command line: run, record, replay, refusals.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <string>

#include "tests/cli/cli_runner.hpp"
#include "tests/support/csv_table.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;

constexpr const char* kTitanium = " --fault metal:rod,material=titanium,diameter_m=0.03,length_m=0.15,position_m=0.3/0.09/0";

constexpr const char* kAluminium =
    " --fault metal:sheet,material=aluminium,width_m=0.15,height_m=0.15,thickness_m=0.0013,position_m=0.25/0.15/0,axis=0/1/0";

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

TEST(DualBand, ARecordingOfAnotherTrackerReplaysWithBothBands) {
    const std::string poses = path_in_temp("dual_band_poses.csv");
    const auto record = [](const std::string& tracker) {
        const std::string take = path_in_temp("dual_band_take_" + tracker);
        std::filesystem::remove_all(take);
        run("--tracker " + tracker + " --record " + take + kTitanium);
        return take;
    };
    const std::string direct = record("direct");
    const std::string take = record("dual-band");
    EXPECT_EQ(tricoil("replay " + direct + " --tracker dual-band --out " + poses).exit_code, 0);
    const CsvTable later(read_file(poses));
    const CsvTable live(read_file(take + "/poses.csv"));  // with the exact time between frames, not that of time stamps
    ASSERT_EQ(later.rows(), live.rows());
    for (std::size_t n = 0; n < live.rows(); ++n) {
        EXPECT_EQ(later.text(n, "flags"), live.text(n, "flags"));
        for (const char* axis : {"x_m", "y_m", "z_m"}) {
            EXPECT_NEAR(later.number(n, axis), live.number(n, axis), 1e-7);
        }
    }
}

std::string coils(const std::string& name, const std::string& low_band_ratio = "", const std::string& moment_2 = "6.75e-3") {
    return write_file(name, "version = 1\nmodel = \"concentric\"\n[source]\nmoment = [[6.75e-3, 0, 0], [0, " + moment_2 +
                                ", 0], [0, 0, 6.75e-3]]\n"
                                "[sensor]\nsensitivity = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n" +
                                low_band_ratio);
}

TEST(DualBand, TheRatioOfTheBandsIsCalibrated) {
    const std::string take = path_in_temp("turned");
    std::filesystem::remove_all(take);
    run("--tracker dual-band --record " + take);
    const std::string rest = path_in_temp("resting");
    std::filesystem::remove_all(rest);
    run("--scenario still --tracker dual-band --record " + rest);
    const std::string both = path_in_temp("both.toml");
    const CliResult fit =
        tricoil("calibrate low-band --json --calibration " + coils("coils.toml") + " --out " + both + " " + take + " " + rest);
    ASSERT_EQ(fit.exit_code, 0) << fit.err;
    EXPECT_GT(fit.json()["columns"], 2000);
    const double sigma = fit.json()["ratio_sigma"].get<double>();
    EXPECT_LT(sigma, 1e-3);
    EXPECT_NEAR(fit.json()["least_ratio"].get<double>(), 1, 5 * sigma);
    EXPECT_NEAR(fit.json()["most_ratio"].get<double>(), 1, 5 * sigma);
    EXPECT_LT(fit.json()["low_band_quadrature_floor"].get<double>(), 5e-3);
    EXPECT_THAT(read_file(both), HasSubstr("low_band_ratio"));
    EXPECT_THAT(read_file(both), HasSubstr("low_band_phase_rad"));
    EXPECT_THAT(read_file(both), HasSubstr("motion_lag_s"));
    const auto error_m = [](const std::string& calibration, const char* metal = kTitanium) {
        return run("--scenario still --tracker dual-band --calibration " + calibration + metal)["position_rms_m"].get<double>();
    };
    const std::string wrong =
        coils("wrong.toml", "[couplings]\nlow_band_ratio = [[1.02, 1.02, 1.02], [1.02, 1.02, 1.02], [1.02, 1.02, 1.02]]\n");
    EXPECT_LT(error_m(both), error_m(wrong) / 5);
    // Quadratures show aluminium if the phases of both bands are known.
    const std::string with_phases = write_file("with_phases.toml", "quadrature_floor = 1e-4\n" + read_file(both));
    EXPECT_LT(error_m(with_phases, kAluminium), 0.9 * error_m(both, kAluminium));
}

/// Voltage induced by a rate X' at a carrier w, and leakage in the window: 1.5 X' / w into the own carrier.
TEST(DualBand, TheQuadratureByMotionIsCalibrated) {
    const std::string take = path_in_temp("moved");
    std::filesystem::remove_all(take);
    ASSERT_EQ(tricoil("run --mux dual-band --duration 6 --record " + take).exit_code, 0);
    const auto lag_with = [&](const std::string& calibration) {
        const CliResult fit =
            tricoil("calibrate low-band --json --calibration " + calibration + " --out " + path_in_temp("lag.toml") + " " + take);
        EXPECT_EQ(fit.exit_code, 0) << fit.err;
        return fit.json()["motion_lag_s"].get<std::array<std::array<double, 3>, 3>>();
    };
    const auto lag_s = lag_with(coils("equal.toml"));
    const std::array<double, 3> carrier_hz{7680, 10080, 13440};
    for (std::size_t i = 0; i < 3; ++i) {
        const double own_s = -1.5 / (2 * M_PI * carrier_hz[i]);
        EXPECT_NEAR(lag_s[i][i], own_s, 0.05 * std::abs(own_s)) << i;
    }
    const auto unequal_s = lag_with(coils("unequal.toml", "", "1.35e-2"));  // couplings to coil 2 are then halved
    EXPECT_NEAR(unequal_s[1][0], 2 * lag_s[1][0], 1e-6);
    EXPECT_NEAR(unequal_s[0][1], lag_s[0][1] / 2, 1e-6);
    EXPECT_NEAR(unequal_s[2][0], lag_s[2][0], 1e-6);
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
        {"run --mux dual-band --rate-hz 144 --tracker dual-band", "use another frame rate"},
        {"run --mux dual-band --rate-hz 480", "fewer than two cycles of a low carrier per window"},
        {"run --mux dual-band --tracker fixed-direct", "integer trackers use one band"},
        {"replay " + take + " --tracker dual-band", "has no columns of two bands"},
        {"calibrate low-band --out x.toml " + take, "--calibration is required"},
        {"calibrate low-band --calibration " + coils("coils.toml") + " --out x.toml " + take, "has no columns of two bands"},
        {"calibrate low-band --spacing-mm 50 --calibration " + coils("coils.toml") + " --out x.toml " + take,
         "--spacing-mm is an option of tricoil calibrate grid, tricoil calibrate surroundings, not of tricoil calibrate "
         "low-band"},
        {"run --mux dual-band --tracker dual-band --calibration " +
             coils("no_floor.toml", "[couplings]\nlow_band_quadrature_floor = 2\n"),
         "their quadrature floor a share of 0 to 1"},
        {"run --mux dual-band --tracker dual-band --calibration " +
             coils("slow.toml", "[couplings]\nmotion_lag_s = [[1, 0, 0], [0, 0, 0], [0, 0, 0]]\n"),
         "the lag by motion must be -0.005 to 0.005 s"},
        {"run --mux dual-band --tracker dual-band --calibration " +
             coils("absurd.toml", "[couplings]\nlow_band_ratio = [[9, 1, 1], [1, 1, 1], [1, 1, 1]]\n"),
         "ratio of the low to the high band must be 0.5 to 2"},
    };
    for (const auto& [command, message] : refusals) {
        const CliResult result = tricoil(command);
        EXPECT_EQ(result.exit_code, 2) << command << result.err;
        EXPECT_THAT(result.err, HasSubstr(message)) << command;
    }
}

}  // namespace
}  // namespace tricoil::test

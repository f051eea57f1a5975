#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/cli/cli_runner.hpp"
#include "tests/support/csv_table.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;

nlohmann::json run(const std::string& arguments) {
    const CliResult result = tricoil("run --json " + arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.json();
}

TEST(Run, FdmDirectReachesItsBound) {
    for (const char* scenario : {"hand", "line", "circle", "still"}) {
        const auto json = run("--duration 4 --mux fdm --tracker direct --scenario " + std::string(scenario));
        const double ratio = json["position_rms_m"].get<double>() / json["bound_position_rms_m"].get<double>();
        EXPECT_LT(ratio, 1.2) << scenario;
        EXPECT_GT(ratio, 0.8) << scenario;
        EXPECT_EQ(json["poses_invalid"], 0) << scenario;
        EXPECT_EQ(json["blocks_lost"], 0) << scenario;
        EXPECT_TRUE(json["coils_off"]) << scenario;
    }
}

TEST(Run, ColumnFidelityFollowsTheSeedAndTheFaults) {
    const std::string options = "--duration 2 --fidelity columns --mux tdm --tracker scaat ";
    const auto first = run(options + "--seed 3");
    EXPECT_EQ(first["position_rms_m"], run(options + "--seed 3")["position_rms_m"]);
    EXPECT_NE(first["position_rms_m"], run(options + "--seed 4")["position_rms_m"]);
    EXPECT_TRUE(first["coils_off"]);
    EXPECT_NEAR(run(options + "--fault dropped_blocks:0.2")["blocks_lost"].get<int>(), 288, 60);
    EXPECT_EQ(tricoil("run " + options + "--fault unplugged@0-2").exit_code, 1);
    const auto metal = run("--duration 2 --fidelity columns --scenario still --fault metal:0.4,0.1,0,0.04@1-2");
    EXPECT_NE(metal["flags_seen"].get<std::string>().find("distorted"), std::string::npos) << metal["flags_seen"];
}

TEST(Run, ColumnFidelityRefusesOptionsThatNeedSamples) {
    for (const char* options : {"--fault overload:2", "--tracker fixed-direct", "--samples x.bin --tracker fixed-direct"}) {
        const CliResult result = tricoil(std::string("run --fidelity columns ") + options);
        EXPECT_EQ(result.exit_code, 2) << options;
        EXPECT_NE(result.err.find("--fidelity columns: "), std::string::npos) << result.err;
    }
    EXPECT_EQ(tricoil("run --fidelity column").exit_code, 2);
}

TEST(Run, FurtherStationsAreTrackedAtTheSameTimes) {
    const std::string csv = path_in_temp("stations.csv");
    const auto alone = run("--duration 2 --scenario still");
    const auto json = run("--duration 2 --scenario still --stations 3 --out " + csv);
    EXPECT_EQ(json["position_rms_m"], alone["position_rms_m"]);  // the first sensor is not disturbed
    EXPECT_EQ(json["poses_invalid"], 0);
    const CsvTable table(read_file(csv));
    std::map<std::string, std::vector<std::string>> times;
    for (std::size_t row = 0; row < table.rows(); ++row) {
        times[table.text(row, "sensor")].push_back(table.text(row, "time_us"));
        if (times.rbegin()->second.size() > 120) {
            EXPECT_LT(std::stod(table.text(row, "error_position_m")), 0.01) << row;
        }
    }
    ASSERT_EQ(times.size(), 3U);
    EXPECT_EQ(times["1"], times["0"]);
    EXPECT_EQ(times["2"], times["0"]);
    EXPECT_GT(times["0"].size(), 450U);
}

TEST(Run, FaultsOfOneSensorActOnTheFirstStation) {
    const std::string csv = path_in_temp("stations_fault.csv");
    const auto valid_of = [&](const std::string& fault) {
        EXPECT_NE(tricoil("run --duration 1 --scenario still --stations 2 --fault " + fault + " --out " + csv).exit_code, 2);
        const CsvTable table(read_file(csv));
        std::array<int, 2> valid{};
        for (std::size_t row = 0; row < table.rows(); ++row) {
            valid.at(std::stoul(table.text(row, "sensor"))) += std::stoi(table.text(row, "valid"));
        }
        return valid;
    };
    const auto unplugged = valid_of("unplugged");
    EXPECT_EQ(unplugged[0], 0);
    EXPECT_GT(unplugged[1], 200);
    const auto open_coil = valid_of("open_coil:S2");
    EXPECT_EQ(open_coil[0], 0);
    EXPECT_EQ(open_coil[1], 0);
}

TEST(Run, RefusesStationsThatCannotBeSimulated) {
    for (const char* options : {"--stations 0", "--stations 5", "--stations 2 --fidelity columns",
                                "--stations 2 --tracker fixed-direct", "--stations 2 --device can:none"}) {
        const CliResult result = tricoil(std::string("run ") + options);
        EXPECT_EQ(result.exit_code, 2) << options;
        EXPECT_EQ(result.err.find("tricoil: --stations"), 0U) << result.err;
    }
}

TEST(Run, TdmWithoutDeskewHasMotionErrors) {
    const auto naive = run("--duration 4 --mux tdm --no-deskew");
    EXPECT_GT(naive["position_rms_m"].get<double>(), 10 * naive["bound_position_rms_m"].get<double>());
    const auto still = run("--duration 4 --mux tdm --no-deskew --scenario still");
    EXPECT_LT(still["position_rms_m"].get<double>(), 1.2 * still["bound_position_rms_m"].get<double>());
}

/// Deskew brings the columns to one instant; the filter uses each column at its own time.
TEST(Run, DeskewAndFilterReduceMotionErrors) {
    const auto naive = run("--duration 4 --mux tdm --no-deskew");
    const auto deskewed = run("--duration 4 --mux tdm");
    const auto filtered = run("--duration 4 --mux tdm --tracker scaat");
    EXPECT_NE(deskewed["assumed"]["columns"], naive["assumed"]["columns"]);
    EXPECT_LT(deskewed["position_rms_m"].get<double>(), naive["position_rms_m"].get<double>() / 8);
    EXPECT_LT(filtered["position_rms_m"].get<double>(), naive["position_rms_m"].get<double>() / 15);
}

TEST(Run, WritesPosesInChosenUnitsAndAngles) {
    const std::string csv = path_in_temp("output_frame.csv");
    run("--duration 1 --mux tdm --tracker scaat --units mm --euler zyx --tip 0.1,0,0 --out " + csv);
    const CsvTable poses(read_file(csv));
    const auto value = [&](const std::string& name) { return poses.number(poses.rows() - 1, name); };
    EXPECT_LE(std::abs(value("euler_zyx_3_deg")), 180);
    // The error is that of the reported position, the tip.
    const double x = value("x_mm") - value("true_x_mm");
    const double y = value("y_mm") - value("true_y_mm");
    const double z = value("z_mm") - value("true_z_mm");
    EXPECT_NEAR(1e3 * value("error_position_m"), std::sqrt(x * x + y * y + z * z), 1e-3);
}

TEST(Run, CsvNamesTheFlags) {
    const std::string csv = path_in_temp("flag_names.csv");
    run("--duration 1 --fault metal:0.6,0.3,0,0.08 --out " + csv);
    const CsvTable poses(read_file(csv));
    EXPECT_EQ(poses.number(poses.rows() - 1, "flags"), 0x1008);
    EXPECT_EQ(poses.text(poses.rows() - 1, "flag_names"), "distorted uncertain");
}

/// The summary goes to standard error.
TEST(Run, AMinusIsStandardOutput) {
    const std::string csv = path_in_temp("same.csv");
    run("--duration 0.5 --out " + csv);
    for (const std::string json : {"", " --json"}) {
        const auto piped = tricoil("run --duration 0.5 --out -" + json);
        EXPECT_EQ(piped.exit_code, 0) << piped.err;
        EXPECT_EQ(piped.out, read_file(csv));
        EXPECT_THAT(piped.err, HasSubstr("scored"));
    }
    const std::string take = path_in_temp("take_of_minus");
    std::filesystem::remove_all(take);
    run("--duration 0.5 --record " + take);
    EXPECT_EQ(tricoil("replay " + take + " --out -").out, read_file(take + "/poses.csv"));
    EXPECT_EQ(tricoil("convert " + take + " --out -").out, tricoil("convert " + take).out);
    EXPECT_FALSE(std::filesystem::exists("-"));
}

/// The poses of the recording of the same run, whose attitudes and deviations are rounded, with a time in UTC.
TEST(Run, JsonLinesGoToStandardOutput) {
    const std::string take = path_in_temp("take_of_lines");
    std::filesystem::remove_all(take);
    const auto piped = tricoil("run --duration 1 --json-lines - --record " + take);
    EXPECT_EQ(piped.exit_code, 0) << piped.err;
    EXPECT_THAT(piped.err, HasSubstr("scored"));
    std::istringstream lines(piped.out);
    std::istringstream recorded(tricoil("convert --to jsonl " + take).out);
    int count = 0;
    for (std::string line, other; std::getline(lines, line) && std::getline(recorded, other); ++count) {
        const auto end = line.find("\"q_wxyz\"");
        ASSERT_EQ(line.substr(0, end), other.substr(0, other.find("\"q_wxyz\"")));
        ASSERT_GT(nlohmann::json::parse(line)["utc_s"].get<double>(), 1.7e9);
    }
    EXPECT_GT(count, 230);
    EXPECT_EQ(std::count(piped.out.begin(), piped.out.end(), '\n'), count);
}

TEST(Run, JsonLinesHaveTipsAndReferences) {
    const auto last = [](const std::string& options) {
        const std::string out = tricoil("run --scenario still --duration 1 --json-lines - " + options).out;
        return nlohmann::json::parse(out.substr(out.rfind('\n', out.size() - 2) + 1));
    };
    const std::vector<double> sensor = last("")["position_m"];
    const std::vector<double> tip = last("--tip 0.1,0,0")["position_m"];
    EXPECT_NEAR(std::hypot(tip[0] - sensor[0], tip[1] - sensor[1], tip[2] - sensor[2]), 0.1, 1e-6);
    const auto reference = last("--stations 2 --relative-to 2");
    EXPECT_EQ(reference["sensor"], 1);
    EXPECT_EQ(reference["position_m"][0], 0);
}

TEST(Run, RefusesJsonLinesThatCannotBeWritten) {
    for (const auto& [options, reason] : std::vector<std::pair<std::string, std::string>>{
             {"--json-lines tcp:5005", "--json-lines tcp:5005: must be - (standard output); tricoil serve has tcp: and udp:"},
             {"--json-lines - --out -", "--json-lines - and --out - exclude each other"},
             {"--json-lines - --json --device serial:/dev/null", "exclude each other"}}) {
        const auto result = tricoil("run " + options);
        EXPECT_EQ(result.exit_code, 2) << options;
        EXPECT_EQ(result.out, "") << options;
        EXPECT_THAT(result.err, HasSubstr(reason));
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }
}

TEST(Run, PosesPredictTheirOwnErrors) {
    for (const char* options :
         {"--mux tdm --no-deskew", "--mux fdm", "--mux tdm --tracker previous --no-deskew", "--mux tdm --tracker scaat"}) {
        const auto json = run("--duration 6 " + std::string(options));
        const double position = json["predicted_position_rms_m"].get<double>() / json["position_rms_m"].get<double>();
        const double orientation =
            json["predicted_orientation_rms_deg"].get<double>() / json["orientation_rms_deg"].get<double>();
        EXPECT_NEAR(position, 1, 0.15) << options;
        EXPECT_NEAR(orientation, 1, 0.15) << options;
        const double expected = json["expected_position_rms_m"].get<double>() / json["position_rms_m"].get<double>();
        EXPECT_GT(expected, 0.9) << options;
        EXPECT_LT(expected, 1.35) << options << ": the deviations cover a motion error of any direction";
    }
}

TEST(Run, PreviousMeasurementFollowsTheHand) {
    const auto direct = run("--duration 4 --mux fdm");
    const auto json = run("--duration 4 --mux fdm --tracker previous --passes 2");
    EXPECT_LT(json["position_rms_m"].get<double>(), 1.3 * direct["position_rms_m"].get<double>());
    EXPECT_EQ(json["acquisitions"], 1);
}

TEST(Run, IntegerTrackersAreAsGoodAsThoseInDouble) {
    for (const std::string method : {"direct", "previous"}) {
        const auto exact = run("--duration 3 --mux fdm --tracker " + method);
        const auto fixed = run("--duration 3 --mux fdm --tracker fixed-" + method);
        EXPECT_EQ(fixed["poses_scored"], exact["poses_scored"]) << method;
        EXPECT_NEAR(fixed["position_rms_m"].get<double>(), exact["position_rms_m"].get<double>(), 1e-7) << method;
        EXPECT_NEAR(fixed["orientation_rms_deg"].get<double>(), exact["orientation_rms_deg"].get<double>(), 1e-4) << method;
        EXPECT_EQ(fixed["blocks_refused"], 0) << method;
        EXPECT_EQ(fixed["acquisitions"], 1) << method;
    }
}

TEST(Run, EqualSeedsGiveEqualRuns) {
    const auto without_timing = [](nlohmann::json json) {
        json.erase("update_us");
        json.erase("simulated_s_per_s");
        return json;
    };
    EXPECT_EQ(without_timing(run("--duration 1 --seed 5")), without_timing(run("--duration 1 --seed 5")));
    EXPECT_NE(run("--duration 1 --seed 5")["position_rms_m"], run("--duration 1 --seed 6")["position_rms_m"]);
}

TEST(Run, CsvHoldsEveryPoseBesideTheTruth) {
    const std::string path = path_in_temp("poses.csv");
    run("--duration 1 --out " + path);
    const std::string text = read_file(path);
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 1 + 239);  // the first of 240 blocks is not used: the coils settle
    EXPECT_TRUE(text.starts_with("sensor,sequence,time_us,"));
    EXPECT_EQ(text.find("nan"), std::string::npos);
}

TEST(Run, FaultsAreFlaggedAndRecoveredFrom) {
    const auto drops = run("--duration 3 --fault dropped_blocks:0.3@1-2");
    EXPECT_GT(drops["blocks_lost"].get<int>(), 30);
    EXPECT_LT(drops["position_max_m"].get<double>(), 5e-3);
    EXPECT_THAT(drops["flags_seen"].get<std::string>(), ::testing::HasSubstr("columns_missing"));
    EXPECT_EQ(drops["health"]["seen_warnings"], "more than 1 % of the columns are missing");
    EXPECT_GT(drops["health"]["worst_missing_percent"].get<double>(), 15);
    EXPECT_EQ(drops["health"]["lost"].get<int>(), 3 * drops["blocks_lost"].get<int>());
    EXPECT_EQ(run("--duration 2")["health"]["seen_warnings"], "");
    const auto plug =
        run("--scenario unplugged --confined");  // not confined, the hemisphere is unknown after two seconds without columns
    EXPECT_THAT(plug["flags_seen"].get<std::string>(), ::testing::HasSubstr("no_sensor"));
    EXPECT_NEAR(plug["poses_invalid"].get<double>(), 480, 5);
    EXPECT_LT(plug["position_max_m"].get<double>(), 1e-3);
    EXPECT_GE(plug["acquisitions"].get<int>(), 2);
}

/// The motion is estimated from columns up to three frames apart, also at a low rate.
TEST(Run, EveryTrackerWorksAtLowRates) {
    for (const char* tracker : {"direct", "previous", "scaat"}) {
        const auto json = run("--duration 3 --rate-hz 60 --mux tdm --tracker " + std::string(tracker));
        EXPECT_EQ(json["poses_invalid"], 0) << tracker;
        EXPECT_EQ(json["poses_distorted"], 0) << tracker;
    }
}

/// Poses near metal are too uncertain to be used, but they show on which side of the source the sensor is.
TEST(Run, MetalDoesNotLoseTheHemisphere) {
    const auto json = run("--scenario still --tracker direct --duration 3 --fault metal:0.3,0.16,0,0.06@1-2");
    EXPECT_GT(json["poses_invalid"].get<int>(), 200);
    EXPECT_LT(json["poses_invalid"].get<int>(), 300) << "240 frames with metal";
}

TEST(Run, NoValidPoseIsAFailedCheck) {
    const CliResult result = tricoil("run --duration 1 --fault reversed_coil:S1");
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_THAT(result.err, ::testing::HasSubstr("wrong_handedness"));
}

TEST(Run, MetalRaisesTheDistortion) {
    const auto clean = run("--duration 3");
    const auto metal = run("--duration 3 --scenario metal");
    EXPECT_GT(metal["poses_distorted"].get<double>(), 5 * clean["poses_distorted"].get<double>());
    EXPECT_GT(metal["position_rms_m"].get<double>(), clean["position_rms_m"].get<double>());
}

/// The couplings are for a calibration of this metal, so the poses of the tracker, which does not know it, do not matter.
TEST(Run, CouplingsAreASuccessWithoutAValidPose) {
    const std::string file = path_in_temp("soOx_seEx_metal.csv");
    const std::string metal = "run --scenario still --duration 1 --fidelity columns --fault metal:0.25,0.12,0,0.06";
    const auto poses = tricoil(metal);
    EXPECT_EQ(poses.exit_code, 1) << poses.out;
    EXPECT_THAT(poses.err, HasSubstr("is metal near the coils")) << "the half space is known";
    const auto couplings = tricoil(metal + " --couplings " + file);
    EXPECT_EQ(couplings.exit_code, 0) << couplings.err;
    EXPECT_THAT(couplings.err, HasSubstr("no valid pose"));
    EXPECT_EQ(CsvTable(read_file(file)).rows(), 1U);
}

TEST(Run, CouplingsWithoutAPoseAreAnErrorWithoutAFile) {
    const std::string file = path_in_temp("soOx_seEx_unplugged.csv");
    const auto result = tricoil("run --scenario still --duration 1 --fault unplugged --couplings " + file);
    EXPECT_EQ(result.exit_code, 1) << result.out;
    EXPECT_THAT(result.err, HasSubstr("not written, because no pose has couplings: no_sensor"));
    EXPECT_FALSE(std::filesystem::exists(file));
}

}  // namespace
}  // namespace tricoil::test

// tricoil run --bands 2: errors with metal, noise without metal, standard deviations, refused options.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/cli/cli_runner.hpp"
#include "tests/support/csv_table.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;

const std::string kSheet = "metal:sheet,width_m=0.2,height_m=0.2,thickness_m=0.0013,position_m=0.25/0.2/0,axis=0/1/0,material=";
const std::string kMovingSphere =
    "metal:sphere,radius_m=0.03,position_m=0.25/0.11/-0.1,to_m=0.25/0.11/0.1,speed_m_s=0.3,material=";

nlohmann::json run(const std::string& options) {
    const CliResult result = tricoil("run --json " + options);
    EXPECT_EQ(result.exit_code, 0) << options << ' ' << result.err;
    return result.json();
}

double error_mm(const std::string& options) { return 1e3 * run(options)["position_rms_m"].get<double>(); }

TEST(TwoBands, PoorConductorsDisturbTenTimesLess) {
    for (const char* material : {"304", "titanium"}) {
        const std::string options = "--scenario still --duration 3 --fault " + kSheet + material;
        const double one = error_mm(options + " --bands 1");
        const double two = error_mm(options + " --bands 2");
        std::printf("%s sheet, sensor at rest: %.2f mm with one band, %.3f mm with two\n", material, one, two);
        EXPECT_LT(two, 0.1 * one) << material;
    }
}

struct Row {
    double error_m = 0;
    bool valid = false;
    bool beyond = false;  // five standard deviations on one axis
};

/// Poses after the first half second, by time.
std::map<std::string, Row> read_poses(const std::string& csv) {
    const CsvTable table(read_file(csv));
    std::map<std::string, Row> rows;
    for (std::size_t n = 0; n < table.rows(); ++n) {
        Row row{table.number(n, "error_position_m"), table.number(n, "valid") == 1, false};
        for (const std::string axis : {"x", "y", "z"}) {
            const double error = table.number(n, axis + "_m") - table.number(n, "true_" + axis + "_m");
            row.beyond = row.beyond || std::abs(error) > 5 * table.number(n, "std_" + axis + "_m");
        }
        if (table.number(n, "time_us") > 5e5) {
            rows[table.text(n, "time_us")] = row;
        }
    }
    return rows;
}

std::map<std::string, Row> poses(const std::string& options) {
    const std::string csv = path_in_temp("poses.csv");
    run(options + " --out " + csv);
    return read_poses(csv);
}

/// Of all poses, also those that are not valid.
double rms_mm(const std::map<std::string, Row>& rows) {
    double sum = 0;
    for (const auto& [time, row] : rows) {
        sum += row.error_m * row.error_m;
    }
    return 1e3 * std::sqrt(sum / static_cast<double>(rows.size()));
}

TEST(TwoBands, GoodConductorsGiveValidPosesWhereOneBandHasNone) {
    for (const char* material : {"aluminium", "copper"}) {
        const std::string options = "--scenario still --duration 3 --fault " + kSheet + material;
        const std::string csv = path_in_temp("one.csv");
        EXPECT_EQ(tricoil("run " + options + " --out " + csv).exit_code, 1) << material;  // no valid pose
        const double one = rms_mm(read_poses(csv));
        const auto rows = poses(options + " --bands 2");
        const double two = rms_mm(rows);
        std::printf("%s sheet, sensor at rest: %.2f mm with one band, %.2f mm with two\n", material, one, two);
        EXPECT_LT(two, one / 5) << material;
        EXPECT_TRUE(std::all_of(rows.begin(), rows.end(), [](const auto& row) { return row.second.valid; })) << material;
    }
}

/// Iron and steel act more on the low band than on the high band.
TEST(TwoBands, SteelDisturbsLessAndAgreesWithTheStandardDeviations) {
    const std::string options = "--scenario still --duration 2 --fault " + kSheet + "steel";
    const double one = error_mm(options + " --bands 1");
    const auto rows = poses(options + " --bands 2");
    const double two = rms_mm(rows);
    std::printf("steel sheet, sensor at rest: %.2f mm with one band, %.2f mm with two\n", one, two);
    EXPECT_LT(two, 0.7 * one);
    EXPECT_GT(two, 0.3 * one);  // not cured: the page of metal says so
    EXPECT_TRUE(std::none_of(rows.begin(), rows.end(), [](const auto& row) { return row.second.valid && row.second.beyond; }));
}

TEST(TwoBands, MovingMetalBesideAHandAgreesWithTheStandardDeviations) {
    int valid = 0;
    int beyond = 0;
    double all_one = 0;
    double all_two = 0;
    for (const char* material : {"titanium", "304", "416", "aluminium"}) {
        const std::string options = std::string("--scenario hand --seed 3 --duration 3 --fault ") + kMovingSphere + material;
        const auto one = poses(options + " --bands 1");
        const auto two = poses(options + " --bands 2");
        for (const auto& [time, row] : two) {
            valid += row.valid ? 1 : 0;
            beyond += row.valid && row.beyond ? 1 : 0;
        }
        const double error_one = rms_mm(one);
        const double error_two = rms_mm(two);
        std::printf("%s sphere, hand and sphere move: %.2f mm with one band, %.2f mm with two\n", material, error_one, error_two);
        EXPECT_LT(error_two, error_one) << material;
        all_one += error_one * error_one;
        all_two += error_two * error_two;
    }
    std::printf("beyond five standard deviations: %d of %d valid poses\n", beyond, valid);
    EXPECT_LT(all_two, 0.25 * all_one);
    EXPECT_GT(valid, 2000);
    EXPECT_LE(beyond, valid / 1000);
}

TEST(TwoBands, WithoutMetalTheErrorIsThatOfOneBandAndNothingIsDistorted) {
    for (const char* tracker : {"direct", "scaat"}) {
        const std::string options = std::string("--scenario hand --seed 2 --duration 6 --tracker ") + tracker;
        const auto one = run(options);
        const auto two = run(options + " --bands 2");
        std::printf("%s, no metal: %.3f mm with one band, %.3f mm with two\n", tracker, 1e3 * one["position_rms_m"].get<double>(),
                    1e3 * two["position_rms_m"].get<double>());
        EXPECT_LT(two["position_rms_m"].get<double>(), 1.1 * one["position_rms_m"].get<double>()) << tracker;
        EXPECT_EQ(two["poses_invalid"], 0) << tracker;
        EXPECT_LE(two["poses_distorted"].get<int>(), two["poses_scored"].get<int>() / 1000) << tracker;
    }
}

TEST(TwoBands, RefusesWhatItCannotDoWithOneLine) {
    const std::string out = path_in_temp("refused.csv");
    const std::pair<std::string, const char*> cases[] = {
        {"--bands 3", "--bands 3: must be 1 or 2"},
        {"--bands 0", "--bands 0: must be 1 or 2"},
        {"--bands 2 --mux tdm", "two bands need FDM"},
        {"--bands 2 --rate-hz 200", "not with --rate-hz 200"},
        {"--bands 2 --record " + out, "not with --record"},
        {"--bands 2 --calibration " + out, "not with --calibration"},
        {"--bands 2 --tracker fixed-direct", "not with --tracker fixed-direct"},
        {"--bands 2 --fidelity columns", "not with --fidelity columns"},
        {"--bands 2 --device can:vcan0", "not with a device"},
    };
    for (const auto& [options, message] : cases) {
        const CliResult result = tricoil("run " + options + " --out " + out);
        EXPECT_EQ(result.exit_code, 2) << options;
        EXPECT_THAT(result.err, HasSubstr(message)) << options;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        EXPECT_FALSE(std::filesystem::exists(out)) << options;
    }
}

}  // namespace
}  // namespace tricoil::test

// `tricoil calibrate pivot`, and `--tip` with its result.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/cli/cli_runner.hpp"
#include "tests/support/csv_table.hpp"

namespace tricoil::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

void expect_pivot_refused(const std::string& arguments, const std::string& what) {
    const auto r = tricoil(arguments);
    EXPECT_EQ(r.exit_code, 2) << arguments << r.out << r.err;
    EXPECT_THAT(r.err, HasSubstr(what)) << arguments;
    EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;
}

/// A recording and CSV file of one simulated run of the scenario `pointer`.
class Pointer : public ::testing::Test {
protected:
    static void SetUpTestSuite() {
        fs::remove_all(kTake);
        ASSERT_EQ(tricoil("run --scenario pointer --tracker scaat --mux tdm --duration 10 --record " + kTake + " --out " + kCsv)
                      .exit_code,
                  0);
    }
    static inline const std::string kTake = path_in_temp("pointer_take");
    static inline const std::string kCsv = path_in_temp("pointer.csv");
};

TEST_F(Pointer, TipIsThatOfTheScenarioFromEveryKindOfFile) {
    const std::string jsonl = path_in_temp("pointer.jsonl");
    ASSERT_EQ(tricoil("convert " + kTake + " --to jsonl --out " + jsonl).exit_code, 0);
    for (const std::string& poses : {kTake, kCsv, jsonl}) {
        const auto r = tricoil("calibrate pivot --json " + poses).json();
        const double x = r["tip_m"][0].get<double>() - 0.15;
        const double y = r["tip_m"][1];
        const double z = r["tip_m"][2].get<double>() - 0.02;
        EXPECT_LT(std::sqrt(x * x + y * y + z * z), 0.15e-3) << poses;
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_LT(r["tip_std_m"][axis].get<double>(), 1e-5) << poses;
        }
        EXPECT_NEAR(r["pivot_m"][0].get<double>(), 0.6, 1e-4) << poses;
        EXPECT_GT(r["invalid"].get<int>(), 0) << poses;
    }
}

TEST_F(Pointer, PosesHaveTheUnitThatTheyName) {
    for (const std::string format : {"csv", "jsonl"}) {
        const std::string metres = path_in_temp("pointer_m." + format);
        ASSERT_EQ(tricoil("convert " + kTake + " --to " + format + " --out " + metres).exit_code, 0);
        const auto expected = tricoil("calibrate pivot --json " + metres).json();
        for (const std::string unit : {"mm", "in"}) {
            const std::string poses = path_in_temp("pointer_" + unit + "." + format);
            ASSERT_EQ(tricoil("convert " + kTake + " --to " + format + " --units " + unit + " --out " + poses).exit_code, 0);
            const auto r = tricoil("calibrate pivot --json " + poses);
            ASSERT_EQ(r.exit_code, 0) << r.err;
            for (int axis = 0; axis < 3; ++axis) {
                EXPECT_NEAR(r.json()["tip_m"][axis].get<double>(), expected["tip_m"][axis].get<double>(), 1e-9);
                EXPECT_NEAR(r.json()["tip_std_m"][axis].get<double>(), expected["tip_std_m"][axis].get<double>(), 1e-9);
            }
        }
    }
}

/// All poses of the tip are at the pivot, and their standard deviations are those of the tip.
TEST_F(Pointer, TipAppliesToTheCsv) {
    const std::string tip = path_in_temp("pointer_tip.toml");
    const auto r = tricoil("calibrate pivot " + kTake + " --out " + tip);
    ASSERT_EQ(r.exit_code, 0) << r.err;
    const std::string out = path_in_temp("at_tip.csv");
    ASSERT_EQ(tricoil("run --scenario pointer --seed 2 --duration 3 --tip " + tip + " --out " + out).exit_code, 0);
    const CsvTable poses(read_file(out));
    const CsvTable sensor(read_file(kCsv));
    double squares = 0;
    for (std::size_t row = 100; row < poses.rows(); ++row) {
        EXPECT_NEAR(poses.number(row, "x_m"), 0.6, 1e-3);
        EXPECT_NEAR(poses.number(row, "true_x_m"), 0.6, 1e-4);
        EXPECT_NEAR(poses.number(row, "z_m"), 0, 1e-3);
        squares += std::pow((poses.number(row, "z_m") - 0) / poses.number(row, "std_z_m"), 2);
    }
    EXPECT_NEAR(squares / static_cast<double>(poses.rows() - 100), 1, 0.3);
}

TEST(PointerTip, CovarianceOfTheTipIsAdded) {
    const std::string out = path_in_temp("at_wide_tip.csv");
    const std::string wide = write_file("wide.toml",
                                        "version = 1\nkind = \"tip\"\nsensor = 0\ntip_m = [0.15, 0, 0.02]\n"
                                        "covariance_m2 = [[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-4]]\n");
    ASSERT_EQ(tricoil("run --scenario pointer --duration 1 --tip " + wide + " --out " + out).exit_code, 0);
    const CsvTable poses(read_file(out));
    EXPECT_NEAR(poses.number(poses.rows() - 1, "std_y_m"), 0.01, 1e-4);
}

TEST(PointerTip, MotionThatDoesNotDetermineTheTipIsRefused) {
    const std::string out = path_in_temp("no_tip.toml");
    const std::string poses = path_in_temp("refused.csv");
    const auto refuse = [&](const std::string& tilt, const std::string& what) {
        const std::string scenario =
            write_file("tilt.toml", "duration_s = 5\n[motion]\nkind = \"pivot\"\ntilt_deg = " + tilt + "\n");
        ASSERT_EQ(tricoil("run --scenario " + scenario + " --out " + poses).exit_code, 0);
        expect_pivot_refused("calibrate pivot " + poses + " --out " + out, what);
    };
    refuse("[0, 0, 30]", "about one axis only (");
    refuse("[1, 1, 1]", "tilt the pointer to all sides");
    ASSERT_EQ(tricoil("run --scenario hand --duration 5 --out " + poses).exit_code, 0);
    expect_pivot_refused("calibrate pivot " + poses + " --out " + out, "the tip is not at rest");
    EXPECT_FALSE(fs::exists(out));
}

TEST_F(Pointer, FilesWithoutPosesAreNamed) {
    const std::string head = "sensor,valid,x_m,y_m,z_m,qw,qx,qy,qz,std_x_m,std_y_m,std_z_m,std_rx_rad,std_ry_rad,std_rz_rad\n";
    const std::string good = "0,1,0,0,0,1,0,0,0,1,1,1,1,1,1\n";
    const auto refuse = [](const std::string& text, const std::string& what) {
        const std::string path = write_file("poses.txt", text);
        expect_pivot_refused("calibrate pivot " + path, path + what);
    };
    refuse("x_ft,y_ft\n1,2\n", ": no column x_m");
    refuse("x_mm,y_mm\n1,2\n", ": no column z_m");
    refuse(head + "0,1,0\n", ":2: 3 fields; the header has 15");
    refuse(head + good + "0,1,0,0,x,1,0,0,0,1,1,1,1,1,1\n", ":3: 'x' in column z_m is not a number");
    refuse(head + "0,1,0,0,0,2,0,0,0,1,1,1,1,1,1\n", ":2: quaternion has length 2.000, not 1");
    refuse(head + "0,1,0,0,0,1,0,0,0,1,1,-1,1,1,1\n", ":2: a standard deviation is negative");
    refuse(head + good + "1" + good.substr(1), ": has the sensors 0, 1; choose one with --sensor");
    refuse(head, ": has no poses");
    refuse(head + good, ": 1 valid poses; at least 10");
    refuse("{\"position_m\": [1, 2]}\n", ": no column x_m");
    refuse("{\n", ":1: is no JSON object");
    expect_pivot_refused("calibrate pivot " + kCsv + " --sensor 2", "has no sensor 2; it has 0");
    expect_pivot_refused("calibrate pivot /nowhere", "/nowhere");
    const std::string before = read_file(kCsv);
    expect_pivot_refused("calibrate pivot " + kCsv + " --out " + kCsv, "--out " + kCsv + ": is also an input file");
    EXPECT_EQ(read_file(kCsv), before);
    expect_pivot_refused("calibrate pivot " + kCsv + " " + kCsv, "DATA is given 2 times; give it once");
    expect_pivot_refused("calibrate pivot --spacing-mm 5 " + kCsv, "is an option of tricoil calibrate grid");
    expect_pivot_refused("calibrate stage --sensor 1 --out x.toml " + kCsv, "is an option of tricoil calibrate pivot");
}

TEST(PointerTip, InvalidTipsAreNamed) {
    const auto refuse = [](const std::string& tip, const std::string& what) {
        expect_pivot_refused("run --duration 1 --out /dev/null --tip " + tip, what);
    };
    refuse("1,2", "--tip 1,2: give X,Y,Z");
    refuse("1,2,x", "--tip 1,2,x: give X,Y,Z");
    refuse("9:1,2,3", "the sensor must be 0 to 3");
    refuse("0,0,nan", "must lie within 100 m");
    refuse("0,0,0 --tip 0:1,2,3", "sensor 0 has a tip already");
    refuse("/nowhere.toml", "/nowhere.toml");
    const auto refuse_file = [&](const std::string& text, const std::string& what) {
        const std::string path = write_file("bad_tip.toml", text);
        refuse(path, path + what);
    };
    refuse_file("x = 1\n", ": is not a tip");
    refuse_file("kind = \"tip\"\nversion = 2\n", ":2: 'version' must be 1");
    refuse_file("kind = \"tip\"\nversion = 1\n", ": 'tip_m' is missing");
    refuse_file("kind = \"tip\"\nversion = 1\ntip_m = [1, 2]\n", ":3: 'tip_m' must be three");
    refuse_file("kind = \"tip\"\nversion = 1\ntip_m = [1, 2, 3]\ncovariance_m2 = [[1, 0, 0], [0, -1, 0], [0, 0, 1]]\n",
                ":4: 'covariance_m2' must be a covariance");
    refuse_file("kind = \"tip\"\nversion = 1\ntip_m = [1, 2, 3]\ntop = 1\n", ":4: 'top' is not a known key");
    expect_pivot_refused("run --device can:vcan9 --tip 0,0,0.1", "--tip: no output for its poses");
}

}  // namespace
}  // namespace tricoil::test

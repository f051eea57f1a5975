// tricoil run beside metal: the filter is valid where the direct tracker is, and no valid pose is far from the truth.
#include <gtest/gtest.h>

#include <map>

#include "tests/cli/cli_runner.hpp"
#include "tests/support/csv_table.hpp"

namespace tricoil::test {
namespace {

nlohmann::json run_columns(const std::string& arguments) {
    const CliResult result = tricoil("run --json --fidelity columns " + arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.json();
}

/// Validity of each pose, by its time.
std::map<std::string, bool> validity(const std::string& arguments) {
    const std::string poses = path_in_temp("metal.csv");
    run_columns(arguments + " --out " + poses);
    const CsvTable table(read_file(poses));
    std::map<std::string, bool> valid;
    for (std::size_t n = 0; n < table.rows(); ++n) {
        valid[table.text(n, "time_us")] = table.text(n, "valid") == "1";
    }
    return valid;
}

TEST(Metal, TheFilterIsValidWhereverTheDirectTrackerIs) {
    const auto direct = validity("--mux fdm --scenario metal --tracker direct");
    const auto filter = validity("--mux fdm --scenario metal --tracker scaat");
    ASSERT_EQ(filter.size(), direct.size());
    int fewer = 0;
    for (const auto& [time, valid] : direct) {
        fewer += valid && !filter.at(time) ? 1 : 0;
    }
    EXPECT_LE(fewer, 2) << "the first poses of the filter are unconfirmed";
}

/// Metal is removed before the filter, so that its prediction has neither the error of metal nor that of a held pose.
TEST(Metal, PosesOfTwoBandsArePredicted) {
    const auto rms = [](const std::string& options) {
        return run_columns("--duration 4 --predict 0.02 " + options)["position_rms_m"].get<double>();
    };
    const std::string one_band = "--mux fdm --tracker scaat ";
    const std::string two_bands = "--mux dual-band --tracker dual-band ";
    const std::string beside_a_rod =
        "--scenario circle --fault metal:rod,material=304,diameter_m=0.03,length_m=0.15,position_m=0.3/0.09/0";
    EXPECT_LT(rms(two_bands), 1.1 * rms(one_band));
    EXPECT_LT(rms(two_bands + beside_a_rod), 0.7 * rms(one_band + beside_a_rod));
}

/// Two columns of a frame moved the state of a filter without noise so far that the third one was refused.
TEST(Metal, AFrameThatAgreesOnAPoseIsUsedAsAWhole) {
    const auto result = run_columns("--mux fdm --tracker scaat --seed 1 --no-noise");
    EXPECT_EQ(result["poses_invalid"], 0);
    EXPECT_EQ(result["outliers"], 0);
}

/// A motion that repeats with every frame fits each column alone: it had grown to 58 mm.
TEST(Metal, AFilterInTurnDoesNotOscillate) {
    const auto result = run_columns("--mux tdm --tracker scaat --seed 11 --duration 6 --fault metal:0.6,0.35,0,0.08");
    EXPECT_GT(result["poses_scored"], 2000);
    EXPECT_LT(result["position_max_m"].get<double>(), 0.03);
}

/// A hand passes within a radius of a steel sphere, where the pose is wrong by more than half the range.
TEST(Metal, ThatTouchesTheSensorDoesNotMirrorThePose) {
    for (const char* mux : {"tdm", "fdm"}) {
        const auto result = run_columns(std::string("--tracker scaat --seed 73 --duration 6 --fault "
                                                    "metal:sphere,material=416,radius_m=0.051,position_m=0.4/0/0.05 --mux ") +
                                        mux);
        EXPECT_GT(result["poses_scored"], 60) << mux;
        EXPECT_LT(result["position_max_m"].get<double>(), 0.03) << mux;
    }
}

/// For a second no pose is accurate enough to be followed.
TEST(Metal, AFilterIsBackAfterMetalThatTouchedTheSensor) {
    for (const char* mux : {"tdm", "fdm"}) {
        const auto result = run_columns(std::string("--scenario still --tracker scaat --seed 3 --duration 4 --fault "
                                                    "metal:sphere,material=416,position_m=0.5/0/0.055,radius_m=0.05@1-2 --mux ") +
                                        mux);
        const double scored = result["poses_scored"];
        EXPECT_GT(scored, 0.5 * (scored + result["poses_invalid"].get<double>())) << mux;
    }
}

}  // namespace
}  // namespace tricoil::test

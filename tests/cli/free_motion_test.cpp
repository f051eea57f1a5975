// `tricoil calibrate free-motion` and `grid`: files and options that do not fit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const std::string kCouplings = "x11,x12,x13,x21,x22,x23,x31,x32,x33\n";

/// Column frames of a simulated hand.
class FreeMotion : public ::testing::Test {
protected:
    static void SetUpTestSuite() {
        ASSERT_EQ(tricoil("run --duration 2 --fidelity columns --couplings " + kMotion).exit_code, 0);
    }
    void SetUp() override {
        fs::remove(kOut);
        fs::remove(kBlob);
    }

    static CliResult calibrate(const std::string& arguments) { return tricoil("calibrate " + arguments + " --out " + kOut); }
    static void expect_coils_refused(const std::string& arguments, const std::string& what) {
        const auto r = calibrate(arguments);
        EXPECT_EQ(r.exit_code, 2) << arguments << r.out << r.err;
        EXPECT_THAT(r.err, HasSubstr(what)) << arguments;
        EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;
    }

    static inline const std::string kMotion = path_in_temp("soXoutYup_seXoutYup_motion.csv");
    static inline const std::string kOut = path_in_temp("coils.toml");
    static inline const std::string kBlob = path_in_temp("coils.bin");
};

TEST_F(FreeMotion, OptionsThatDoNotFitAreNamed) {
    const std::string free = "free-motion " + kMotion;
    for (const char* const constant : {"0", "-1", "1e300", "1e-300", "inf", "nan"}) {
        expect_coils_refused(free + " --coupling-constant " + constant, "--coupling-constant must lie between");
    }
    for (const char* const hemisphere : {"0,0,0", "nan,0,0", "inf,0,0"}) {
        expect_coils_refused(free + " --hemisphere " + hemisphere, "--hemisphere must be a direction");
    }
    expect_coils_refused(free + " --spacing-mm 50", "--spacing-mm is an option of tricoil calibrate grid, ");
    expect_coils_refused("stage --hemisphere 1,0,0 " + kMotion, "--hemisphere is an option of tricoil calibrate grid");
    expect_coils_refused(free + " --blob " + kBlob, "--coupling-constant");
    const std::string grid = write_file("grid.csv", "column,row,level," + kCouplings + "0,0,0,2,0,0,0,1,0,0,0,1\n");
    expect_coils_refused("grid --spacing-mm 1e-9 " + grid, "--spacing-mm must be between 1 and 1000");
    EXPECT_FALSE(fs::exists(kOut));
}

TEST_F(FreeMotion, HemisphereIsStored) {
    for (const char* const model : {"concentric", "general"}) {
        ASSERT_EQ(calibrate(std::string("free-motion --hemisphere 0,0,1e100 --model ") + model + " " + kMotion).exit_code, 0);
        EXPECT_THAT(read_file(kOut), HasSubstr("hemisphere = [0, 0, 1]")) << model;
    }
    EXPECT_EQ(calibrate("free-motion --hemisphere 0,0,1e200 " + kMotion).exit_code, 2) << "its square is no number";
}

TEST_F(FreeMotion, FilesThatDoNotFitAreNamed) {
    const std::string empty = write_file("empty.csv", kCouplings);
    const std::string empty_grid = write_file("empty_grid.csv", "column,row,level," + kCouplings);
    expect_coils_refused("free-motion " + empty, empty + ": holds no column frames");
    expect_coils_refused("grid --spacing-mm 50 " + empty_grid, empty_grid + ": holds no column frames");
    expect_coils_refused("free-motion " + kMotion + " " + kMotion, kMotion + ": given twice");
}

TEST_F(FreeMotion, TheHeaderNotTheNameStatesTheKindOfFile) {
    const std::string other = path_in_temp("motion.txt");
    fs::copy_file(kMotion, other, fs::copy_options::overwrite_existing);
    EXPECT_EQ(calibrate("free-motion " + other).exit_code, 0);
}

TEST_F(FreeMotion, FewLeftHandedFramesAreLeftOut) {
    const std::string one = path_in_temp("one.csv");
    std::ofstream(one) << read_file(kMotion) << "0,0,0,1,0,0,0,-2,0,0,0,1,0,0,0,1,0,0,0,0,0,0,0,0,0\n";
    const auto r = calibrate("free-motion --model general " + one);
    EXPECT_EQ(r.exit_code, 0) << r.err;
    EXPECT_THAT(r.out, HasSubstr("one.csv: 1 of 480 column frames are left-handed, not used"));
    EXPECT_THAT(r.out, HasSubstr("for a coupling constant of 1"));
    std::ofstream(one) << kCouplings << "-2,0,0,0,1,0,0,0,1\n2,0,0,0,1,0,0,0,1\n";
    expect_coils_refused("free-motion " + one, "one.csv: 1 of 2 column frames are left-handed; correct the wiring");
}

TEST_F(FreeMotion, OlderFilesSurviveAFailureAndInputsAreNotReplaced) {
    std::ofstream(kBlob) << "older";
    std::ofstream(kOut) << "older";
    const std::string free = " --coupling-constant 1 " + kMotion;
    EXPECT_EQ(tricoil("calibrate free-motion --out /nowhere/coils.toml --blob " + kBlob + free).exit_code, 2);
    EXPECT_EQ(tricoil("calibrate free-motion --blob /nowhere/coils.bin --out " + kOut + free).exit_code, 2);
    EXPECT_EQ(read_file(kBlob), "older");
    EXPECT_EQ(read_file(kOut), "older");
    const std::string before = read_file(kMotion);
    expect_coils_refused("free-motion --blob " + kMotion + free, "--blob " + kMotion + ": is also an input file");
    expect_coils_refused("free-motion --blob " + kOut + free, "name the same file");
    EXPECT_EQ(tricoil("calibrate free-motion --out " + kMotion + free).exit_code, 2);
    EXPECT_EQ(read_file(kMotion), before);
}

/// The last version had one command with an option for each kind.
TEST_F(FreeMotion, OldSpellingsWorkWithANotice) {
    const auto same = [](const std::string& old, const std::string& today, const std::string& notice) {
        const auto before = tricoil("calibrate " + old);
        const auto now = tricoil("calibrate " + today);
        EXPECT_EQ(before.exit_code, now.exit_code) << old;
        EXPECT_EQ(before.out, now.out) << old;
        EXPECT_EQ(before.err, "tricoil: calibrate " + notice + "\n" + now.err) << old;
        EXPECT_EQ(now.err.find("spelling"), std::string::npos) << today;
    };
    const std::string out = " --out " + kOut;
    const std::string refused = ": the next version refuses this spelling; use tricoil calibrate ";
    same("--free-motion " + kMotion + out, "free-motion " + kMotion + out, "--free-motion" + refused + "free-motion");
    same("--json" + out + " --free-motion -- " + kMotion, "free-motion --json " + kMotion + out,
         "--free-motion" + refused + "free-motion");
    same(kMotion + out, "stage " + kMotion + out, "without a kind" + refused + "stage");
    same("--wiring 0.4,0.2,0.1 " + kMotion, "wiring --at 0.4,0.2,0.1 " + kMotion, "--wiring" + refused + "wiring --at X,Y,Z");
    same("--wiring=0.4,0.2,0.1 " + kMotion, "wiring --at=0.4,0.2,0.1 " + kMotion, "--wiring" + refused + "wiring --at X,Y,Z");
    same("--pivot " + kMotion, "pivot " + kMotion, "--pivot" + refused + "pivot");
    same("--surroundings --grid --spacing-mm 50 " + kMotion + out, "surroundings --spacing-mm 50 " + kMotion + out,
         "--surroundings" + refused + "surroundings (with --spacing-mm, the data are of a grid)");
    EXPECT_EQ(tricoil("calibrate --grid --pivot " + kMotion).err,
              "tricoil: --grid and --pivot: each is a calibration of its own; choose tricoil calibrate grid or tricoil calibrate "
              "pivot\n");
    EXPECT_EQ(tricoil("calibrate gird " + kMotion).err.find("tricoil: unknown command 'gird'; did you mean 'grid'?"), 0U);
    const auto is_refused = [](const std::string& options, const std::string& what) {
        const auto result = tricoil("calibrate " + options);
        EXPECT_EQ(result.exit_code, 2) << options;
        EXPECT_NE(result.err.find(what), std::string::npos) << result.err;
        EXPECT_EQ(result.err.find("spelling"), std::string::npos) << result.err;
    };
    is_refused("--json", "unknown option '--json'; see tricoil calibrate --help");
    is_refused("--json grid " + kMotion, "--json");
    EXPECT_NE(tricoil("calibrate missing.csv --grid --spacing-mm 50" + out).err.find("missing.csv: cannot be"),
              std::string::npos);
    for (const char* spacing : {"0", "-200", "nan"}) {
        is_refused("surroundings --calibration " + kOut + " --spacing-mm " + spacing + " " + kMotion + " --out x.toml",
                   "--spacing-mm must be between 1 and 1000");
    }
    EXPECT_EQ(tricoil("calibrate").err.find("tricoil: tricoil calibrate needs a command: stage, converters, grid"), 0U);
}

}  // namespace
}  // namespace tricoil::test

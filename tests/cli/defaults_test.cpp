// Defaults of the user (tricoil.toml), -q, -v, and tricoil doctor.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// `tricoil ARGUMENTS` with this tricoil.toml.
CliResult with_defaults(const std::string& toml, const std::string& arguments) {
    const std::string folder = path_in_temp("config");
    std::filesystem::create_directories(folder);
    std::ofstream(folder + "/tricoil.toml") << toml;
    return tricoil(arguments, "export XDG_CONFIG_HOME=" + folder);
}

TEST(Defaults, GiveTheDeviceUnlessTheSensorIsSimulated) {
    const std::string toml = "device = \"can:none0\"\n";
    const auto device = with_defaults(toml, "run --duration 1");
    EXPECT_EQ(device.exit_code, 3) << device.err;
    EXPECT_EQ(device.err.find("tricoil: --device can:none0 from "), 0U) << device.err;
    EXPECT_EQ(with_defaults(toml, "run --duration 1 --scenario still").exit_code, 0);
    EXPECT_EQ(with_defaults(toml, "run --duration 1 --device sim:").exit_code, 0);
    const auto info = with_defaults(toml, "device info --wait 0.1");
    EXPECT_EQ(info.exit_code, 3) << info.err;
    EXPECT_THAT(info.err, HasSubstr("can:none0"));
    EXPECT_THAT(with_defaults(toml, "device info can:none1 --wait 0.1").err, HasSubstr("can:none1"));
    EXPECT_EQ(tricoil("device info", "export XDG_CONFIG_HOME=/nowhere").exit_code, 2);
}

TEST(Defaults, GiveUnitsAndHemisphere) {
    const std::string out = path_in_temp("units.csv");
    const std::string toml = "units = \"mm\"\nhemisphere = [-1, 0, 0]\n";
    const auto run = with_defaults(toml, "run --duration 1 --scenario still --out " + out);
    EXPECT_THAT(run.err, Not(HasSubstr("--hemisphere"))) << "a simulation knows the side of its sensor";
    EXPECT_THAT(run.err, HasSubstr("tricoil: --units mm from "));
    EXPECT_THAT(with_defaults(toml, "run -q --duration 1 --scenario still --out " + out).err, Not(HasSubstr("--units")));
    const auto device = with_defaults(toml, "run --duration 1 --wait 0.1 --device can:none0");
    EXPECT_THAT(device.err, HasSubstr("tricoil: --hemisphere -1,0,0 from "));
    EXPECT_THAT(read_file(out), HasSubstr("x_mm"));
    EXPECT_EQ(with_defaults(toml, "run --duration 1 --scenario still --units m --hemisphere 1,0,0 --out " + out).exit_code, 0);
    EXPECT_THAT(read_file(out), HasSubstr("x_m,"));
    const std::string take = path_in_temp("defaults_take");
    std::filesystem::remove_all(take);
    EXPECT_EQ(with_defaults(toml, "run --duration 1 --scenario still --record " + take).exit_code, 0) << "no output with units";
    EXPECT_THAT(with_defaults(toml, "convert " + take + " --to csv").out, HasSubstr("x_mm"));
    EXPECT_EQ(with_defaults(toml, "convert " + take + " --to openigtlink").exit_code, 0);
    const std::string rests = path_in_temp("defaults-rests");
    std::filesystem::remove_all(rests);
    std::filesystem::copy(take, rests);
    EXPECT_THAT(with_defaults(toml, "convert " + rests + " --to=csv").out, HasSubstr("x_mm"));
    EXPECT_THAT(with_defaults(toml + "device = \"can:none0\"\n", "serve " + take + " --json-lines -").out,
                HasSubstr("position_mm"));
}

TEST(Defaults, StayOutOfOtherCommandLines) {
    const std::string toml = "device = \"can:none0\"\nhemisphere = [-1, 0, 0]\n";
    EXPECT_EQ(with_defaults(toml, "--version run").exit_code, 0);
    EXPECT_EQ(with_defaults(toml, "--version device info").exit_code, 0);
    EXPECT_EQ(with_defaults(toml, "run --duration 0.2 --smooth").exit_code, 0);
    EXPECT_EQ(with_defaults(toml, "run --duration 0.2 --tracker fixed-direct").exit_code, 0);
    const auto config = with_defaults(toml, "run --config /nonexistent/board.toml");
    EXPECT_EQ(config.exit_code, 2);
    EXPECT_THAT(config.err, Not(HasSubstr("--hemisphere")));
    EXPECT_EQ(tricoil("run --duration 0.2", "export XDG_CONFIG_HOME=/dev/null").exit_code, 0);
    EXPECT_EQ(with_defaults("device = \"sim:\"\n", "device info").exit_code, 2) << "no device is named";
}

TEST(Defaults, DamagedFilesAreOneLineWithFileAndLine) {
    for (const auto& [toml, what] : std::initializer_list<std::pair<const char*, const char*>>{
             {"units = \"mm\"\ndevice = \n", "tricoil.toml:2: "},
             {"\nunits = \"km\"\n", "tricoil.toml:2: "},
             {"hemisphere = [0, 0, 0]\n", "tricoil.toml:1: 'hemisphere' must be a direction"},
             {"device = \"cab:can0\"\n", "tricoil.toml:1: 'device' "},
             {"devise = \"can:can0\"\n", "tricoil.toml:1: 'devise' is not a known key"}}) {
        const auto run = with_defaults(toml, "run --duration 1");
        EXPECT_EQ(run.exit_code, 2) << toml;
        EXPECT_THAT(run.err, HasSubstr(what));
        EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
        EXPECT_EQ(with_defaults(toml, "run --help").exit_code, 0);
        const auto doctor = with_defaults(toml, "doctor --json");
        EXPECT_EQ(doctor.exit_code, 1);
        EXPECT_THAT(doctor.out, HasSubstr("correct or delete the file"));
    }
}

TEST(Verbosity, EveryCommandTakesIt) {
    const std::string old = "calibrate --wiring 0.4,0.2,0.1 /nowhere.csv";
    EXPECT_THAT(tricoil(old).err, HasSubstr("spelling"));
    EXPECT_THAT(tricoil("-q " + old).err, Not(HasSubstr("spelling")));
    EXPECT_THAT(tricoil(old + " --quiet").err, HasSubstr("/nowhere.csv"));
    for (const char* command : {"selfcheck", "run --list", "help run", "motion --example III"}) {
        const auto plain = tricoil(command);
        for (const char* option : {" -q", " -v", " --quiet", " --verbose"}) {
            const auto result = tricoil(command + std::string(option));
            EXPECT_EQ(result.exit_code, plain.exit_code) << command << option << result.err;
            EXPECT_EQ(result.out.size(), plain.out.size()) << command << option;
        }
    }
}

TEST(Doctor, NamesTheMendOfEachFailure) {
    const auto doctor = tricoil("doctor --json");
    const auto json = doctor.json();
    EXPECT_EQ(doctor.exit_code, json["ok"].get<bool>() ? 0 : 1);
    EXPECT_GE(json["checks"].size(), 6U);
    for (const auto& check : json["checks"]) {
        EXPECT_NE(check["ok"].get<bool>(), check.contains("mend")) << check;
    }
    const std::string text = tricoil("doctor").out;
    EXPECT_THAT(text, HasSubstr("version: tricoil "));
    EXPECT_THAT(text, HasSubstr("udev rules: "));
    EXPECT_EQ(tricoil("doctor now").exit_code, 2);
}

}  // namespace
}  // namespace tricoil::test

// Input without end, or far beyond the limits: refused with one line, quickly and with little memory.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>

#include "tests/cli/cli_runner.hpp"
#include "tests/support/instrumented.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Sanitizers reserve terabytes of address space, so their builds run without this limit.
constexpr const char* kHalfAGigabyte = kSlowdown == 1 ? "ulimit -v 524288" : ":";

void expect_refused(const std::string& arguments, const std::string& reason) {
    const auto result = tricoil(arguments, kHalfAGigabyte);
    EXPECT_EQ(result.exit_code, 2) << arguments << ": " << result.err.substr(0, 300);
    EXPECT_THAT(result.err, HasSubstr(reason)) << arguments;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err.substr(0, 300);
}

const std::string kPoseHeader = "x_m,y_m,z_m,qw,qx,qy,qz,x11,x12,x13,x21,x22,x23,x31,x32,x33\n";

std::string calibration_with(const std::string& translation) {
    return "version = 1\nmodel = \"concentric\"\nresidual_rms = 0\n"
           "[source]\nmoment = [[1,0,0],[0,1,0],[0,0,1]]\n[sensor]\nsensitivity = [[1,0,0],[0,1,0],[0,0,1]]\n"
           "[source_stage.\"Ox\"]\ntranslation_m = " +
           translation + "\nrotation = [[1,0,0],[0,1,0],[0,0,1]]\n[mount_sensor.\"Ex\"]\nrotation = [[1,0,0],[0,1,0],[0,0,1]]\n";
}

TEST(Limits, PlacesBeyondAKilometre) {
    const std::string couplings = ",1,0,0,0,2e-3,0,0,0,-1e-3,0,0,0,-1e-3\n";
    const std::string far = write_file("soOx_seEx_far.csv", kPoseHeader + "0.5,0,0" + couplings + "4294967296,0,0" + couplings);
#ifdef TRICOIL_WITH_PYTHON
    expect_refused("calibrate stage --out " + path_in_temp("cal.toml") + " " + far,
                   "far.csv:3: the position lies more than 1 km away");
#endif
    expect_refused("run --calibration " + write_file("far.toml", calibration_with("[1e15,0,0]")),
                   "translation_m' is longer than 1 km");
    expect_refused("run --scenario " + write_file("far_circle.toml", "[motion]\nkind = \"circle\"\ncentre_m = [1e308, 0, 0]\n"),
                   "'motion.centre_m' must lie within 1000 m");
}

TEST(Limits, KeysOfManyParts) {
    std::string deep = "a";
    for (int n = 0; n < 40'000; ++n) {
        deep += ".a";
    }
    for (const std::string& text :
         {deep + " = 1\n", "[" + deep + "]\n", "x = {" + deep + " = 1}\n", "\"=\"." + deep + " = 1\n"}) {
        const std::string path = write_file("deep.toml", "# a.b.c\ns = \"a.b\"\n" + text);
        expect_refused("run --scenario " + path, "deep.toml:3: a key of more than 16 parts");
        expect_refused("run --config " + path, "deep.toml:3: a key of more than 16 parts");
        expect_refused("run --device can:can0 --config " + path, "a key of more than 16 parts");
        expect_refused("run --calibration " + path, "a key of more than 16 parts");
    }
    const std::string numbers = "x = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]\n";
    expect_refused("run --scenario " + write_file("numbers.toml", numbers), "'motion.kind' is missing");
}

TEST(Limits, InputWithoutAnEnd) {
    for (const char* command : {"run --trajectory /dev/zero", "run --calibration /dev/zero", "run --config /dev/zero"}) {
        expect_refused(command, "/dev/zero");
    }
#ifdef TRICOIL_WITH_PYTHON
    expect_refused("calibrate stage --model concentric --out x.toml /dev/zero", "/dev/zero");
#endif
}

TEST(Limits, TextOfManyShortLines) {
    std::string text;
    while (text.size() < std::size_t{8} << 20U) {
        text += "# comment\n";
    }
    const std::string path = write_file("comments.toml", text);
    for (const char* option : {"run --scenario ", "run --config ", "run --calibration "}) {
        expect_refused(option + path, "comments.toml: is longer than");
    }
}

TEST(Limits, InvalidNumbersAreRefused) {
    expect_refused("run --seed 99999999999999999999", "--seed: 99999999999999999999 is not an integer from 0 to");
    expect_refused("run --seed -1", "--seed");
    expect_refused("run --wait -1", "--wait: -1 is not a number of seconds, 0 or more");
    expect_refused("device info can:can0 --wait 0", "--wait: 0 is not a positive number of seconds");
    expect_refused("device mode can:can0 --rate-hz nan", "--rate-hz must be a finite number");
    expect_refused("device info can:can0 --wait nan", "--wait: nan is not a positive number of seconds");
    for (const char* value : {"-1", "nan", "inf"}) {
        expect_refused(std::string("run --device can:can0 --give-up-after ") + value, "--give-up-after");
    }
}

TEST(Limits, ADeviceThatNeverWorksIsGivenUp) {
    const auto result = tricoil("run --device serial:/dev/nope --wait 0 --give-up-after 0.5");
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_THAT(result.err, HasSubstr("serial:/dev/nope: the device has not worked for 0.5 s; giving up"));
}

TEST(Limits, ARunWithoutScoredPosesHasNoErrorFigures) {
    const auto text = tricoil("run --scenario still --duration 0.3");
    EXPECT_THAT(text.out, HasSubstr("no pose was scored"));
    EXPECT_THAT(text.out, Not(HasSubstr("0.000 mm")));
    EXPECT_TRUE(tricoil("run --scenario still --duration 0.3 --json").json()["position_rms_m"].is_null());
}

TEST(Limits, ADeviceThatIsNotThereEndsTheWatch) {
    const auto begin = std::chrono::steady_clock::now();
    const auto result = tricoil("device watch serial:/dev/nope");
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_THAT(result.err, HasSubstr("/dev/nope"));
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
}

}  // namespace
}  // namespace tricoil::test

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;

/// Bad usage: exit code 2 and exactly one line that starts with the program's name.
void expect_usage_error(const std::string& arguments, const std::string& message) {
    const CliResult result = tricoil(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_THAT(result.err, HasSubstr(message)) << arguments;
    EXPECT_TRUE(result.err.starts_with("tricoil: ")) << arguments << "\n" << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << arguments << "\n" << result.err;
    EXPECT_EQ(result.out, "") << arguments;
}

TEST(Usage, HelpAndVersionPrint) {
    EXPECT_THAT(tricoil("--version").out, HasSubstr("tricoil 0."));
    const CliResult help = tricoil("--help");
    EXPECT_EQ(help.exit_code, 0);
    EXPECT_THAT(help.out, HasSubstr("demodulate"));
    EXPECT_THAT(help.out, HasSubstr("Exit codes"));
    EXPECT_THAT(tricoil("run --help").out, HasSubstr("--trajectory"));
    EXPECT_THAT(tricoil("run --list").out, HasSubstr("paper-iii"));
}

TEST(Usage, EveryCommandHasJsonOutput) {
    const std::string help = tricoil("--help").out;
    std::istringstream lines(help.substr(0, help.find("\nHelp:\n")));
    int commands = 0;
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with("  ") || line[2] == ' ') {  // a group, or further lines of a description
            continue;
        }
        const std::string command = line.substr(2, line.find(' ', 2) - 2);
        const std::string own = tricoil(command + " --help").out;
        const bool has_commands = own.find("Commands:") != std::string::npos;
        EXPECT_TRUE(has_commands || own.find("--json") != std::string::npos) << command;
        ++commands;
    }
    EXPECT_GE(commands, 10);
#ifdef TRICOIL_WITH_PYTHON
    EXPECT_THAT(tricoil("protocol --json").json()["page"].get<std::string>(), HasSubstr("pose"));
    const std::string dbc = path_in_temp("tricoil.dbc");
    EXPECT_EQ(tricoil("protocol --json --dbc " + dbc).json()["dbc_file"], dbc);
#endif
}

TEST(Usage, UnknownNamesGetASuggestion) {
    expect_usage_error("rum", "did you mean 'run'");
    expect_usage_error("run --mux tmd", "did you mean 'tdm'");
    expect_usage_error("run --tracker previus", "did you mean 'previous'");
    expect_usage_error("run --tracker fixed-prev", "did you mean 'fixed-previous'");
    expect_usage_error("run --device can:vcan9 --tracker fixed-direct", "--tracker fixed-direct: computes poses from samples");
    expect_usage_error("run --device can:vcan9 --tracker direct --samples /tmp/s", "--samples: not with a device");
    expect_usage_error("serve --openigtlink 0 --tracker fixed-direct", "--tracker fixed-direct: computes poses from samples");
    expect_usage_error("run --scenario hnd", "did you mean 'hand'");
    expect_usage_error("run --fault open_coyl:S1", "did you mean 'open_coil'");
    expect_usage_error("run --nonsense-option", "unknown option '--nonsense-option'; see tricoil run --help");
    expect_usage_error("run --sede 3", "unknown option '--sede'; did you mean '--seed'? See tricoil run --help");
    expect_usage_error("run -seed 3", "unknown option '-seed'; did you mean '--seed'?");
    expect_usage_error("--verzion", "unknown option '--verzion'; did you mean '--version'? See tricoil --help");
    expect_usage_error("device wach", "unknown command 'wach'; did you mean 'watch'?");
    expect_usage_error("device", "tricoil device needs a command: list, info,");
    expect_usage_error("motion --example IV", "unknown example 'IV'; choices: I, II, III,");
}

/// Other programs connect when `serve` has printed its addresses, so it must print none if it refuses its options.
TEST(Usage, ServePrintsNoAddressesWithInvalidOptions) {
    expect_usage_error("serve --json-lines 5005", "must be tcp:[ADDRESS:]PORT, udp:[HOST:]PORT or - (standard output)");
    expect_usage_error("serve --json-lines udp:127.0.0.1:0", "name the port of the receiver");
    expect_usage_error("serve --json-lines udp:127.0.0.1:00", "name the port of the receiver");
    expect_usage_error("serve --json-lines udp:[]:9", "no such address");
    expect_usage_error("serve --json-lines tcp:192.0.2.1:0", "--json-lines 192.0.2.1:0");
    expect_usage_error("serve --json-lines ''", "--json-lines");
    expect_usage_error("serve --openigtlink 0 --fault nonsense", "nonsense");
    expect_usage_error("serve --openigtlink 0 --scenario hnd", "did you mean 'hand'");
    expect_usage_error("serve --openigtlink 0 --rate-hz 1e9", "--rate-hz");
    expect_usage_error("serve --openigtlink 0 --hemisphere nan,0,0", "hemisphere");
    expect_usage_error("serve --list", "--list");
}

TEST(Usage, ConfigurationErrorsNameTheLine) {
    const auto refuse = [](const std::string& text, const std::string& message) {
        const std::string path = write_file("board.toml", text);
        expect_usage_error("run --config " + path, path + ":" + message);
    };
    refuse("device = \"can:can0#16\"", "1: 'device' device 'can:can0#16': '16' is not a valid node number, 0 to 15");
    refuse("device = \"can:can0\"\nspeed = 3", "2: 'speed' is not a known key");
    refuse("\n\n[coils]\nchip = \"x\"\ns1 = \"a\"\ns2 = \"b\"\ns3 = \"a\"", "7: 'coils.s3' is the line of another coil");
    refuse("[coils]\nchip = 1", "2: 'coils.chip' must be a string in quotes");
    refuse("[tracker]\nmethod = \"scat\"", "2: 'tracker.method' has the unknown value 'scat'; did you mean 'scaat'?");
    refuse("[realtime]\npriority = 100", "2: 'realtime.priority' must be a whole number from 0 to 99");
    refuse("[tracker]\nconfined = 1", "2: 'tracker.confined' must be true or false");
    refuse("[health]\nmissing_percent = 101", "2: 'health.missing_percent' must be 100 or less");
    refuse("[health]\nmissing_percent = nan", "2: 'health.missing_percent' must be");
    refuse("[health]\nage_ms = 1e300", "2: 'health.age_ms' must be 1e6 or less");
    refuse("[health]\nage_ms = 0", "2: 'health.age_ms' must be");
    refuse("[health]\ntemperature_c = \"hot\"", "2: 'health.temperature_c' must be");
    refuse("[outputs]\npublish = 1", "2: 'outputs.publish' must be true or false");
    refuse("[tracker", "1: ");
    expect_usage_error("run --config " + write_file("empty.toml", ""), "'device' is missing");
    expect_usage_error("run --config " + write_file("confined.toml", "device = \"can:vcan9\"\n[tracker]\nconfined = true"),
                       "confined: give the half space too");
    expect_usage_error("run --config /no/such/file", "/no/such/file: cannot be opened");
}

TEST(Usage, OptionsWithoutEffectAreRefused) {
    expect_usage_error("run --duration 1 --predict 0.02", "--tracker direct estimates no velocity; use --tracker scaat");
    expect_usage_error("run --duration 1 --tracker scaat --predict 10",
                       "--predict 10: must be a number of seconds, 0 (no prediction) to 0.1");
    expect_usage_error("run --duration 1 --predict -1", "--predict");
    expect_usage_error("run --device can:vcan9 --predict 0.02", "--tracker direct estimates no velocity; use --tracker scaat");
    expect_usage_error("run --duration 1 --tracker scaat --predict -0.1", "--predict");
    expect_usage_error("run --duration 1 --tracker scaat --mux tdm --no-deskew", "--no-deskew");
    expect_usage_error("run --duration 1 --mux fdm --no-deskew", "--no-deskew");
    expect_usage_error("run --duration 1 --tracker fixed-direct --no-deskew", "--no-deskew: not with --tracker fixed-direct");
    expect_usage_error("run --duration 1 --tracker fixed-direct --predict 0.1",
                       "--tracker fixed-direct estimates no velocity; use --tracker scaat");
    expect_usage_error("run --duration 1 --tracker fixed-previous --record /tmp/r", "--record (use --samples)");
    expect_usage_error("run --duration 1 --samples /tmp/samples.bin", "--samples: only with --tracker fixed-direct");
    expect_usage_error("run --duration 1 --tracker fixed-direct --samples /no/such/folder/f", "cannot write /no/such/folder/f");
    for (const char* option : {"--tip 0.1,0,0", "--align 0,0,0,1,0,0,0,1,0", "--boresight", "--units mm", "--euler zyx"}) {
        expect_usage_error(std::string("run --duration 1 ") + option, "--out");
    }
    expect_usage_error("run --duration 1 --euler ''", "--euler");
    expect_usage_error("run --device can:vcan9 --confined", "confined: give the half space too");
    expect_usage_error("run --device can:vcan9 --confined --hemisphere 0,0,0", "confined: give the half space too");
    expect_usage_error("run --duration 1 --out /dev/null --tip 1e308,1e308,0", "--tip");
}

/// The first wrong word is named, also if a required option is missing because of it.
TEST(Usage, UnexpectedWordsAreNamedOnce) {
    expect_usage_error("run circle", "unexpected argument 'circle'; did you mean '--scenario circle'? See tricoil run --help");
    expect_usage_error("run scaat hand", "unexpected argument 'scaat'; did you mean '--tracker scaat'?");
    expect_usage_error("run one two", "unexpected argument 'one'; see tricoil run --help");
    expect_usage_error("demodulate c.csv --carier-hz 1e4 --rate-hz 2e5",
                       "unknown option '--carier-hz'; did you mean '--carrier-hz'?");
    expect_usage_error("demodulate c.csv --rate-hz 2e5", "--carrier-hz is required (");
    expect_usage_error("demodulate --carrier-hz 1e4 --rate-hz 2e5", "CAPTURE is required (WAV file, or table");
    expect_usage_error("run --out --json", "--out needs a value: FILE; see tricoil run --help");
    expect_usage_error("run --duration 1 --out", "--out needs a value: FILE");
    expect_usage_error("run --out= --json", "--out needs a value: FILE");
    expect_usage_error("run --json=yes", "--json takes no value");
    expect_usage_error("run --seed 1 --seed 2", "--seed is given 2 times; give it once");
    expect_usage_error("run --place 1,2", "--place 1,2: expected 3 comma-separated numbers");
    expect_usage_error("run --place 1,2,x", "--place 1,2,x: expected 3 comma-separated numbers");
    expect_usage_error("run --predict ''", "--predict needs a value: SECONDS");
    expect_usage_error("run --trajectory '' --duration 1", "--trajectory needs a value: FILE");
    expect_usage_error("run --place 1,0,0", "--place: no recorded path to place; add --trajectory FILE");
    expect_usage_error("run --speed 0", "--speed 0: must be positive");
    expect_usage_error("run --speed 1e9 --duration 1", "--speed 1000000000: must be positive, at most 100");
    for (const std::string option : {"--speed 2", "--scenario still", "--seed 3", "--no-noise"}) {
        const std::string name = option.substr(0, option.find(' '));
        expect_usage_error("run --out - --device can:can0 " + option, name + ": only with a simulated sensor");
        expect_usage_error("serve --json-lines - --device can:can0 " + option, name + ": only with a simulated sensor");
    }
}

TEST(Usage, NumbersOutOfRangeAreNamed) {
    expect_usage_error("run --rate-hz 0", "frame rate");
    expect_usage_error("run --rate-hz nan", "frame rate");
    expect_usage_error("run --rate-hz -240", "frame rate");
    expect_usage_error("run --rate-hz 241", "whole number of samples");
    expect_usage_error("run --rate-hz 960 --mux tdm", "use FDM");
    expect_usage_error("run --rate-hz fast", "--rate-hz");
    expect_usage_error("run --duration 0", "--duration");
    expect_usage_error("run --duration nan", "--duration");
    expect_usage_error("run --duration -1", "--duration");
    expect_usage_error("run --passes 0", "passes");
    expect_usage_error("run --passes 2 --tracker scaat", "--passes: only with --tracker previous");
    expect_usage_error("run --duration 1 --fault unplugged@50-60", "begins at 50 s, but the run ends at 1 s");
    expect_usage_error("run --hemisphere 1,0", "--hemisphere");
    expect_usage_error("run --hemisphere inf,0,0", "--hemisphere");
    expect_usage_error("run --fault dropped_blocks:2", "0 to 1");
    expect_usage_error("run --device tcp:host", "use sim:, can:INTERFACE");
    expect_usage_error("run --device sim:hand", "the simulated device is 'sim:', only in tricoil run and serve, with --scenario");
    expect_usage_error("run --seed -1", "--seed");
    expect_usage_error("run --rate-hz fast", "--rate-hz fast: expected a number");
    expect_usage_error("run --passes 1.5", "--passes 1.5: expected a whole number");
    expect_usage_error("motion --azimuth fast,1", "--azimuth fast,1: expected 2 comma-separated numbers");
}

TEST(Usage, UnusableFilesAreNamed) {
    expect_usage_error("run --trajectory /no/such.traj", "/no/such.traj");
    expect_usage_error("run --trajectory /tmp", "folder");
    expect_usage_error("run --trajectory " + write_file("short.traj", "1 0 0 0\n"), "short.traj:1");
    expect_usage_error("run --trajectory " + write_file("empty.traj", ""), "is empty");
    std::string path;
    for (int pose = 0; pose < 8; ++pose) {
        path += "1 0 0 0.5" + std::to_string(pose) + "\n0 1 0 0\n0 0 1 0\n0 0 0 1\n\n";
    }
    for (const char* predict : {"0.068", "0.1"}) {  // of 0.07 s
        expect_usage_error(
            std::string("run --tracker scaat --predict ") + predict + " --trajectory " + write_file("brief.traj", path),
            "brief.traj: the path leaves less than one block at --speed 1 with --predict");
    }
    expect_usage_error("run --scenario " + write_file("bad.toml", "duration_s = true\n"), "bad.toml:1");
    expect_usage_error("run --out /no/such/folder/x.csv", "/no/such/folder/x.csv");
    expect_usage_error("run --out ''", "--out");
    const std::string mine = write_file("protected.csv", "mine");
    std::filesystem::permissions(mine, std::filesystem::perms::owner_read);
    expect_usage_error("run --duration 0.1 --out " + mine, "write-protected");
    EXPECT_EQ(read_file(mine), "mine");
}

TEST(Usage, AFullDiskExitsWith3) {
    // A file size limit of a few kilobytes simulates a full disk.
    const CliResult result = tricoil("run --duration 1 --out " + path_in_temp("full.csv"), "trap '' XFSZ; ulimit -f 16");
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_THAT(result.err, HasSubstr("full.csv"));
}

}  // namespace
}  // namespace tricoil::test

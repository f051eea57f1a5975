// Help, version and manual pages, which are made from one table of options.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cctype>
#include <filesystem>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Names of the commands in a help.
std::vector<std::string> names_in(const std::string& help) {
    std::vector<std::string> names;
    std::istringstream lines(help);
    for (std::string line; std::getline(lines, line);) {
        const auto end = line.find_first_not_of("abcdefghijklmnopqrstuvwxyz-", 2);
        const auto text = line.find_first_not_of(' ', end);
        if (line.starts_with("  ") && line[2] != '-' && end > 2 && text > end && text < line.size() &&
            std::isupper(line[text]) != 0) {
            names.push_back(line.substr(2, end - 2));
        }
    }
    return names;
}

std::vector<std::string> command_names() { return names_in(tricoil("--help").out); }

std::vector<std::string> options_in(const std::string& help) {
    std::vector<std::string> options;
    std::istringstream lines(help);
    for (std::string line; std::getline(lines, line);) {
        if (line.starts_with("  --")) {
            options.push_back(line.substr(2, line.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-", 2) - 2));
        }
    }
    return options;
}

/// As in a manual page.
std::string escaped(const std::string& option) {
    std::string text;
    for (const char c : option) {
        text += c == '-' ? "\\-" : std::string(1, c);
    }
    return text;
}

TEST(Help, WithoutArgumentsItIsTheOverview) {
    const CliResult result = tricoil("");
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_EQ(result.err, "");
    EXPECT_EQ(result.out, tricoil("--help").out);
    EXPECT_THAT(result.out, HasSubstr("Examples:\n"));
    EXPECT_THAT(result.out, HasSubstr("\n  tricoil serve --web 8080\n"));
    EXPECT_GE(command_names().size(), 15U);
}

TEST(Help, EveryCommandHasExamples) {
    for (const std::string& name : command_names()) {
        const CliResult help = tricoil("help " + name);
        EXPECT_EQ(help.exit_code, 0) << name;
        EXPECT_EQ(help.out, tricoil(name + " --help").out) << name;
        EXPECT_EQ(help.out, tricoil(name + " --wrong --help").out) << name;
        EXPECT_THAT(help.out, HasSubstr("\nExamples:\n  # ")) << name;
        EXPECT_THAT(help.out, HasSubstr("\n  tricoil " + name)) << name;
    }
}

TEST(Help, EverySubcommandHasItsOwnExamples) {
    for (const std::string command : {"calibrate", "device"}) {
        for (const std::string& name : names_in(tricoil(command + " --help").out)) {
            const std::string help = tricoil(command + " " + name + " --help").out;
            EXPECT_THAT(help, HasSubstr("\n  tricoil " + command + " " + name)) << help;
            EXPECT_THAT(help, Not(HasSubstr("tricoil serve"))) << help;
        }
    }
}

TEST(Help, OptionsOfRunAreInGroups) {
    const std::string help = tricoil("run --help").out;
    for (const char* group : {"Simulated sensor", "Simulated noise and faults", "Device", "Tracking", "Poses", "Output"}) {
        EXPECT_THAT(help, HasSubstr(std::string("\n") + group + ":\n  --"));
    }
    EXPECT_THAT(help, Not(HasSubstr("\nOptions:\n")));
    EXPECT_THAT(help, HasSubstr("--mux tdm|fdm"));
}

TEST(Help, OfUnknownCommandsNamesTheNearest) {
    EXPECT_EQ(tricoil("help rum").exit_code, 2);
    EXPECT_EQ(tricoil("help rum").err.find("tricoil: unknown command 'rum'; did you mean 'run'?"), 0U);
    EXPECT_EQ(tricoil("help device wach").err.find("tricoil: unknown command 'wach'; did you mean 'watch'?"), 0U);
    EXPECT_EQ(tricoil("rum --help").err.find("tricoil: unknown command 'rum'; did you mean 'run'?"), 0U);
    EXPECT_EQ(tricoil("device wach --help").exit_code, 2);
    EXPECT_EQ(tricoil("help run circle").err, "tricoil: tricoil run has no commands\n");
}

TEST(Help, VersionHasTheCommit) {
    const std::string version = tricoil("--version").out;
    EXPECT_THAT(version, ::testing::MatchesRegex("tricoil [0-9]+\\.[0-9]+\\.[0-9]+( \\([0-9a-f]{12}(, modified)?\\))?\n"));
}

TEST(Manual, APageForEachCommandWithItsOptions) {
    const std::string folder = path_in_temp("man");
    std::filesystem::create_directories(folder);
    ASSERT_EQ(tricoil("__manual " + folder).exit_code, 0);
    const auto parts = std::filesystem::path(TRICOIL_PROGRAM).parent_path().parent_path() / "libexec/tricoil";
    for (const char* part : {"tricoil-serve", "tricoil-tools"}) {
        ASSERT_EQ(std::system(((parts / part).string() + " __manual " + folder).c_str()), 0) << part;
    }
    const std::string overview = read_file(folder + "/tricoil.1");
    for (const std::string& name : command_names()) {
        EXPECT_THAT(overview, HasSubstr(".B " + name + "\n"));
        const std::string page = read_file(folder + "/tricoil-" + name + ".1");
        EXPECT_THAT(page, HasSubstr(".SH EXAMPLES\n")) << name;
        for (const std::string& option : options_in(tricoil(name + " --help").out)) {
            EXPECT_THAT(page, HasSubstr(".B " + escaped(option))) << name;
        }
    }
    EXPECT_THAT(read_file(folder + "/tricoil-device.1"), HasSubstr(".B \\-\\-repeats N\n"));
    EXPECT_THAT(overview, HasSubstr("/etc/tricoil/board.toml"));
}

TEST(Manual, NeedsAFolder) {
    EXPECT_EQ(tricoil("__manual").exit_code, 2);
    EXPECT_EQ(tricoil("__manual /no/such/folder").exit_code, 2);
}

}  // namespace
}  // namespace tricoil::test

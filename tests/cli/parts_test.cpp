// Commands that are executables of their own: found beside the program, never on PATH or in the current folder.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

constexpr const char* kParts[] = {"tricoil-serve", "tricoil-tools", "tricoil-calibration"};
constexpr const char* kCommands[] = {"serve --help", "selfcheck --help", "calibrate --help", "__complete evaluate --",
                                     "help device watch"};

/// A folder with look-alikes of all parts, directly and in the folders in which the program could look.
std::string folder_of_look_alikes() {
    const fs::path folder = path_in_temp("look_alikes");
    for (const char* below : {".", "libexec", "libexec/tricoil", "tricoil"}) {
        fs::create_directories(folder / below);
        for (const char* part : kParts) {
            std::ofstream(folder / below / part) << "#!/bin/sh\necho look-alike\n";
            fs::permissions(folder / below / part, fs::perms::owner_all);
        }
    }
    return folder.string();
}

/// Shell commands before the program: its folder and PATH have look-alikes.
std::string among_look_alikes() {
    const std::string folder = folder_of_look_alikes();
    fs::create_directories(folder + "/bin");
    return "cd " + folder + "/bin; PATH=" + folder + ":" + folder + "/libexec/tricoil:$PATH; export PATH";
}

TEST(Parts, LookAlikesAreNotRun) {
    for (const char* command : kCommands) {
        const CliResult expected = tricoil(command);
        EXPECT_EQ(expected.exit_code, 0) << command;
        const CliResult result = tricoil(command, among_look_alikes());
        EXPECT_EQ(result.exit_code, 0) << command;
        EXPECT_EQ(result.out, expected.out) << command;
        EXPECT_EQ(result.err, expected.err) << command;
    }
}

TEST(Parts, AreFoundThroughALinkOnPath) {
    const fs::path folder = path_in_temp("on_path");
    fs::create_directories(folder);
    fs::create_symlink(TRICOIL_PROGRAM, folder / "tricoil");
    const CliResult result = run_program("tricoil", "selfcheck --help", "PATH=" + folder.string() + ":$PATH");
    EXPECT_EQ(result.out, tricoil("selfcheck --help").out);
}

TEST(Parts, AMissingOneIsNamedInOneLine) {
    const std::string setup = among_look_alikes();
    const fs::path bin = path_in_temp("alone/bin");
    fs::create_directories(bin);
    fs::copy_file(TRICOIL_PROGRAM, bin / "tricoil", fs::copy_options::overwrite_existing);
    for (const auto& [command, part] : {std::pair{"serve --web 0", "tricoil-serve"},
                                        {"device list", "tricoil-tools"},
                                        {"evaluate --help", "tricoil-calibration"}}) {
        const CliResult result = run_program((bin / "tricoil").string(), command, setup);
        EXPECT_EQ(result.exit_code, 3) << command;
        EXPECT_EQ(result.out, "") << command;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        EXPECT_THAT(result.err, HasSubstr("alone/libexec/tricoil/" + std::string(part) + " is not built or not installed; "))
            << command;
    }
    const CliResult help = run_program((bin / "tricoil").string(), "--help", setup);
    EXPECT_EQ(help.out, tricoil("--help").out);
    EXPECT_EQ(run_program((bin / "tricoil").string(), "run --list", setup).out, tricoil("run --list").out);
}

}  // namespace
}  // namespace tricoil::test

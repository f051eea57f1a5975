// Lost standard output: full disk, closed pipe; and names with terminal control sequences.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Runs the program with the redirection or pipe `where`; returns its standard error.
CliResult tricoil_into(const std::string& where, const std::string& arguments) {
    const std::string err = path_in_temp("err_of_full.txt");
    const int status = std::system((TRICOIL_PROGRAM " " + arguments + " 2>" + err + " " + where).c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), "", read_file(err)};
}

TEST(Output, LostOutputIsReported) {
    const std::string recording = path_in_temp("recording_full");
    std::filesystem::remove_all(recording);
    ASSERT_EQ(tricoil("run --scenario still --duration 1 --record " + recording).exit_code, 0);
    for (const std::string& command :
         {std::string("run --scenario still --duration 1"), std::string("run --scenario still --duration 1 --json"),
          std::string("run --list"), "replay " + recording, "replay --json " + recording, "convert " + recording,
          std::string("device list"), std::string("selfcheck"), std::string("run --scenario still --duration 1 --out /dev/full"),
          std::string("--help"), std::string("run --help")}) {
        const auto result = tricoil_into(">/dev/full", command);
        EXPECT_EQ(result.exit_code, 3) << command;
        EXPECT_THAT(result.err, HasSubstr("could not be written completely")) << command;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << command << ": " << result.err;
    }
}

TEST(Output, ClosedPipeLeavesFilesComplete) {
    const std::string out = path_in_temp("beside_a_pipe.csv");
    std::filesystem::remove(out);
    // The reader closes the pipe at once. The summary must be printed after the file is complete.
    const auto result = tricoil_into("| true", "run --scenario still --duration 1 --out " + out);
    const std::string text = read_file(out);
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 240) << result.err;
    EXPECT_TRUE(text.ends_with('\n'));
}

TEST(Output, ControlCharactersOfNamesAreEscaped) {
    const std::string name = "\x1b]0;owned\x07\xc2\x9b";
    const auto refused = tricoil("replay '" + name + "'");
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, Not(HasSubstr("\x1b")));
    EXPECT_THAT(refused.err, HasSubstr("\\x1b]0;owned\\x07\\x9b"));
}

}  // namespace
}  // namespace tricoil::test

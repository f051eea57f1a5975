// Commands that are executables of their own: found beside the program, never on PATH or in the current folder.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

using ::testing::ContainsRegex;
namespace fs = std::filesystem;

/// Names of all commands, as the program completes them.
std::vector<std::string> commands() {
    std::istringstream lines(tricoil("__complete ''").out);
    std::vector<std::string> names;
    for (std::string line; std::getline(lines, line);) {
        names.push_back(line.substr(0, line.find('\t')));
    }
    return names;
}

/// Files that run or are imported behind `tricoil NAME`, and names that could be.
std::vector<std::string> parts() {
    std::vector<std::string> files{"tricoil", "tricoil-tools", "_program.py", "_draw.py", "tricoil.py", "numpy.py"};
    for (const std::string& name : commands()) {
        files.insert(files.end(), {"tricoil-" + name, name, "_" + name + "_command.py"});
    }
    return files;
}

/// A folder with look-alikes of all parts, directly and in the folders in which the program could look. Each leaves the file
/// `ran`.
fs::path folder_of_look_alikes() {
    fs::path folder = path_in_temp("look_alikes");
    fs::remove_all(folder);
    const std::vector<fs::path> places{folder, folder / "bin", folder / "libexec" / "tricoil", folder / "tricoil"};
    for (const fs::path& place : places) {
        fs::create_directories(place);
    }
    const std::string ran = (folder / "ran").string();
    for (const fs::path& place : places) {
        for (const std::string& part : parts()) {
            const fs::path file = place / part;
            if (!fs::is_directory(file)) {
                std::ofstream(file) << (part.ends_with(".py") ? "open('" + ran + "', 'w')\n"
                                                              : "#!/bin/sh\ntouch " + ran + "\necho look-alike\n");
                fs::permissions(file, fs::perms::owner_all);
            }
        }
    }
    return folder;
}

/// Shell commands before the program: its folder, PATH and Python's path have look-alikes.
std::string among_look_alikes(const fs::path& folder) {
    const std::string at = folder.string();
    return "cd " + at + "/bin; export PATH=.:" + at + ":" + at + "/bin:" + at + "/libexec/tricoil:$PATH PYTHONPATH=.:" + at;
}

void expect_the_same(const std::string& command, const fs::path& look_alikes) {
    const CliResult expected = tricoil(command);
    const CliResult result = tricoil(command, among_look_alikes(look_alikes));
    EXPECT_EQ(result.exit_code, expected.exit_code) << command;
    EXPECT_EQ(result.out, expected.out) << command;
    EXPECT_EQ(result.err, expected.err) << command;
    EXPECT_FALSE(fs::exists(look_alikes / "ran")) << command;
}

TEST(Parts, LookAlikesAreNotRun) {
    const fs::path look_alikes = folder_of_look_alikes();
    ASSERT_GT(commands().size(), 15U);
    for (const std::string& name : commands()) {
        EXPECT_EQ(tricoil("help " + name).exit_code, 0) << name;
        for (const std::string& command :
             {name + " --help", "help " + name, "__complete " + name + " --", name + " --no-such-option"}) {
            expect_the_same(command, look_alikes);
        }
    }
}

#ifdef TRICOIL_WITH_PYTHON
TEST(Parts, LookAlikesAreNotImported) {
    const std::string poses = path_in_temp("look_alike_poses.csv");
    ASSERT_EQ(tricoil("run --scenario hand --duration 1 --out " + poses).exit_code, 0);
    const std::string command = "motion --poses " + poses + " --timing tdm:3/720 --json";
    EXPECT_EQ(tricoil(command).exit_code, 0) << tricoil(command).err;
    expect_the_same(command, folder_of_look_alikes());
}
#endif

TEST(Parts, AreFoundThroughALinkOnPath) {
    const fs::path folder = path_in_temp("on_path");
    fs::create_directories(folder);
    fs::create_symlink(TRICOIL_PROGRAM, folder / "tricoil");
    const CliResult result = run_program("tricoil", "selfcheck --help", "PATH=" + folder.string() + ":$PATH");
    EXPECT_EQ(result.out, tricoil("selfcheck --help").out);
}

TEST(Parts, AMissingOneIsNamedInOneLine) {
    const std::string setup = among_look_alikes(folder_of_look_alikes());
    const fs::path bin = path_in_temp("alone/bin");
    fs::create_directories(bin);
    fs::copy_file(TRICOIL_PROGRAM, bin / "tricoil", fs::copy_options::overwrite_existing);
    for (const auto& [command, part] :
         {std::pair{"serve --web 0", "tricoil-serve"}, {"device list", "tricoil-tools"}, {"evaluate data.csv", "_program.py"}}) {
        const CliResult result = run_program((bin / "tricoil").string(), command, setup);
        EXPECT_EQ(result.exit_code, 3) << command;
        EXPECT_EQ(result.out, "") << command;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        EXPECT_THAT(result.err,
                    ContainsRegex("alone/libexec/tricoil/" + std::string(part) + " is not (built or not )?installed; "))
            << command;
    }
    const CliResult help = run_program((bin / "tricoil").string(), "--help", setup);
    EXPECT_EQ(help.out, tricoil("--help").out);
    EXPECT_EQ(run_program((bin / "tricoil").string(), "run --list", setup).out, tricoil("run --list").out);
}

}  // namespace
}  // namespace tricoil::test

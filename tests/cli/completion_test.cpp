// Completion: the candidates that the program gives, and the shells that ask for them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::Not;

/// Words of the candidates, without their meanings.
std::vector<std::string> candidates(const std::string& words) {
    const CliResult result = tricoil("__complete " + words);
    EXPECT_EQ(result.exit_code, 0) << words;
    EXPECT_EQ(result.err, "") << words;
    std::vector<std::string> found;
    std::istringstream lines(result.out);
    for (std::string line; std::getline(lines, line);) {
        found.push_back(line.substr(0, line.find('\t')));
    }
    return found;
}

TEST(Completion, Commands) {
    EXPECT_THAT(candidates("''"), IsSupersetOf({"run", "serve", "device", "completion"}));
    EXPECT_THAT(candidates("sel"), ElementsAre("selfcheck"));
    EXPECT_THAT(candidates("device wr"), ElementsAre("write-calibration"));
    EXPECT_THAT(candidates("help ca"), ElementsAre("calibrate"));
    EXPECT_THAT(tricoil("__complete sel").out, HasSubstr("selfcheck\tRun the self-check"));
}

TEST(Completion, Options) {
    EXPECT_THAT(candidates("run --sc"), ElementsAre("--scenario"));
    EXPECT_THAT(candidates("run --no-noise --no-d"), ElementsAre("--no-deskew"));
    EXPECT_THAT(candidates("serve --web 8080 --open"), IsSupersetOf({"--openigtlink", "--open-controls"}));
    EXPECT_THAT(candidates("device info can:can0 --w"), ElementsAre("--wait"));
    EXPECT_THAT(candidates("run -- --sc"), IsEmpty());
}

TEST(Completion, Values) {
    EXPECT_THAT(candidates("run --scenario pa"), ElementsAre("paper-i", "paper-ii", "paper-iii", ":file"));
    EXPECT_THAT(candidates("run --tracker p"), ElementsAre("previous"));
    EXPECT_THAT(candidates("run --tracker=sc"), ElementsAre("--tracker=scaat"));
    EXPECT_THAT(candidates("run --fault un"), ElementsAre("unplugged"));
    EXPECT_THAT(candidates("run --fault ''"), IsSupersetOf({"metal:", "open_coil:", "unplugged"}));
    EXPECT_THAT(candidates("run --device s"), Contains("sim:"));
    EXPECT_THAT(candidates("device info s"), Contains("sim:"));
    EXPECT_THAT(candidates("run --mux ''"), ElementsAre("tdm", "fdm", "dual-band"));
    EXPECT_THAT(candidates("completion ''"), ElementsAre("bash", "zsh", "fish"));
    EXPECT_THAT(candidates("run --out p"), ElementsAre(":file"));
    EXPECT_THAT(candidates("replay t"), ElementsAre(":folder"));
    EXPECT_THAT(candidates("convert take1 --to ''"), IsSupersetOf({"csv", "mcap"}));
    EXPECT_THAT(candidates("run --seed ''"), IsEmpty());
}

TEST(Completion, WrongWordsGiveNothingAndNoError) {
    EXPECT_THAT(candidates("rum ''"), Not(Contains("selfcheck")));
    EXPECT_THAT(candidates("run --nonsense --sc"), ElementsAre("--scenario"));
    EXPECT_THAT(candidates(""), IsEmpty());
}

/// Runs shell commands after the completion script was loaded; skips a shell that is not installed, and says so.
std::string in_shell(const std::string& shell, const std::string& commands) {
    const std::string script = path_in_temp("completion." + shell);
    EXPECT_EQ(tricoil("completion " + shell + " >" + script + " #").exit_code, 0);
    const std::string bin = path_in_temp("bin");
    const std::string text = write_file("commands." + shell, "source " + script + "\n" + commands + "\n");
    const std::string out = path_in_temp("shell.txt");
    const std::string run = "mkdir -p " + bin + " && ln -sf " + TRICOIL_PROGRAM + " " + bin + "/tricoil && PATH=" + bin +
                            ":$PATH HOME=" + bin + " " + shell + " " + text + " >" + out + " 2>&1";
    EXPECT_EQ(std::system(run.c_str()), 0) << read_file(out);
    return read_file(out);
}

bool is_installed(const std::string& shell) { return std::system(("command -v " + shell + " >/dev/null").c_str()) == 0; }

TEST(Completion, Bash) {
    const auto reply = [](const std::string& words, int current) {
        return in_shell("bash", "compopt() { :; }\nCOMP_WORDS=(" + words + ") COMP_CWORD=" + std::to_string(current) +
                                    "\n_tricoil\necho \"${COMPREPLY[*]}\"");
    };
    EXPECT_EQ(reply("tricoil sel", 1), "selfcheck\n");
    EXPECT_EQ(reply("tricoil run --sce", 2), "--scenario\n");
    EXPECT_EQ(reply("tricoil run --scenario ci", 3), "circle\n");
    EXPECT_EQ(reply("tricoil run --device si", 3), "sim:\n");
    EXPECT_EQ(reply("tricoil run --tracker = sc", 4), "scaat\n");  // bash splits words at =
    EXPECT_EQ(reply("tricoil run --fault unplugged --mu", 4), "--mux\n");
    EXPECT_EQ(reply("tricoil run --device can : can0 --mux f", 7), "fdm\n");  // and at :
}

TEST(Completion, Zsh) {
    if (!is_installed("zsh")) {
        GTEST_SKIP() << "zsh is not installed; toolchain/install-deps test";
    }
    const std::string stubs =
        "compdef() { :; }\nunfunction compadd 2>/dev/null\ncompadd() { print -r -- ${(P)${@[-1]}}; }\n_files() { print files "
        "\"$@\"; }\n";
    const auto reply = [&](const std::string& words, int current) {
        return in_shell("zsh", stubs + "words=(" + words + ") CURRENT=" + std::to_string(current) + "\n_tricoil");
    };
    EXPECT_EQ(reply("tricoil sel", 2), "selfcheck\n");
    EXPECT_EQ(reply("tricoil run --scenario ci", 4), "files\ncircle\n");
    EXPECT_EQ(reply("tricoil run --device si", 4), "sim:\n");
    EXPECT_EQ(reply("tricoil replay ''", 3), "files -/\n");
}

TEST(Completion, Fish) {
    if (!is_installed("fish")) {
        GTEST_SKIP() << "fish is not installed; toolchain/install-deps test";
    }
    EXPECT_EQ(in_shell("fish", "complete -C 'tricoil sel'").substr(0, 10), "selfcheck\t");
    EXPECT_THAT(in_shell("fish", "complete -C 'tricoil run --tracker sc'"), HasSubstr("scaat"));
    EXPECT_THAT(in_shell("fish", "complete -C 'tricoil run --scenario ci'"), HasSubstr("circle\ta circle of 0.3 m"));
}

TEST(Completion, UnknownShellIsRefused) {
    const CliResult result = tricoil("completion fihs");
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.err, "tricoil: unknown shell 'fihs'; did you mean 'fish'? choices: bash, zsh, fish\n");
}

}  // namespace
}  // namespace tricoil::test

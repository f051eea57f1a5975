// tricoil demo: the tour by itself, by keys, and interrupted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "tests/cli/terminal_runner.hpp"
#include "tests/support/instrumented.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;

std::vector<nlohmann::json> json_lines(const std::string& text) {
    std::vector<nlohmann::json> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) {
        lines.push_back(nlohmann::json::parse(line));
    }
    return lines;
}

TEST(Demo, RunsByItselfAndItsResultsAgreeWithItsTexts) {
    constexpr int kStep_s = 3 * kSlowdown;  // the simulation keeps to real time if the machine can
    const CliResult result = tricoil("demo --json --step " + std::to_string(kStep_s));
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto lines = json_lines(result.out);
    ASSERT_EQ(lines.size(), 6U) << result.out;
    EXPECT_THAT(lines[0]["web"].get<std::string>(), HasSubstr("http://127.0.0.1:"));
    const double unfiltered_m = lines[2]["position_rms_m"];
    const double filtered_m = lines[3]["position_rms_m"];
    EXPECT_GT(unfiltered_m, 1e-3);
    EXPECT_LT(filtered_m, 0.2 * unfiltered_m);
    EXPECT_GT(lines[4]["poses_distorted"], 0);
    EXPECT_GT(lines[5]["poses_invalid"], 50);  // unplugged from 2 to 5 s
    EXPECT_EQ(lines[1]["poses_invalid"], 0);
}

TEST(Demo, EnterLeadsToTheNextStepAndQEnds) {
    const auto result =
        tricoil_on_terminal("demo --no-browser", 100, ":", {{"1 of 5", "\n"}, {"2 of 5", "n\n"}, {"3 of 5", "q\n"}});
    EXPECT_EQ(result.exit_code, 0) << result.out;
    EXPECT_THAT(result.out, HasSubstr("live page: http://127.0.0.1:"));
    EXPECT_THAT(result.out, HasSubstr("3 of 5"));
    EXPECT_EQ(result.out.find("4 of 5"), std::string::npos);
    EXPECT_THAT(result.out, HasSubstr("serve --web 8080"));
}

TEST(Demo, CtrlCEndsItCleanly) {
    const auto result = tricoil_on_terminal("demo --no-browser; status=$?; stty -a | grep -o ' .*echo '; exit $status", 100,
                                            "trap : INT", {{"1 of 5", "\x03"}});
    EXPECT_EQ(result.exit_code, 0) << result.out;
    EXPECT_THAT(result.out, HasSubstr("serve --web 8080"));
    EXPECT_THAT(result.out, ::testing::Not(HasSubstr("-echo ")));  // the terminal is as before
}

TEST(Demo, WrongValuesAreRefused) {
    EXPECT_EQ(tricoil("demo --step 0").exit_code, 2);
    EXPECT_EQ(tricoil("demo --web nonsense").exit_code, 2);
    EXPECT_EQ(tricoil("demo --stepp 3").err,
              "tricoil: unknown option '--stepp'; did you mean '--step'? See tricoil demo --help\n");
}

}  // namespace
}  // namespace tricoil::test

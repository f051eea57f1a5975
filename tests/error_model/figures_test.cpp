// The commands as a user meets them: exit codes, one line per mistake, nothing half-written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "board/host/figures/whole_file.hpp"

namespace tricoil::host {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

struct Answer {
    int exit_code = -1;
    std::string output;
};

Answer tricoil(const std::string& arguments) {
    const std::string line = std::string(TRICOIL_PROGRAM) + " " + arguments + " 2>&1";
    FILE* pipe = ::popen(line.c_str(), "r");
    Answer answer;
    std::array<char, 4096> buffer{};
    for (std::size_t n = 0; (n = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
        answer.output.append(buffer.data(), n);
    }
    answer.exit_code = WEXITSTATUS(::pclose(pipe));
    return answer;
}

void expect_refused(const std::string& arguments, const std::string& names) {
    const Answer answer = tricoil(arguments);
    EXPECT_EQ(answer.exit_code, 2) << arguments << "\n" << answer.output;
    EXPECT_THAT(answer.output, HasSubstr(names)) << arguments;
    EXPECT_EQ(std::count(answer.output.begin(), answer.output.end(), '\n'), 1) << answer.output;
}

class Folder : public testing::Test {
protected:
    void SetUp() override {
        path_ = fs::temp_directory_path() / ("tricoil_figures_test_" + std::to_string(::getpid()));
        fs::remove_all(path_);
        fs::create_directory(path_);
    }
    void TearDown() override { fs::remove_all(path_); }
    [[nodiscard]] std::ptrdiff_t entries() const { return std::distance(fs::directory_iterator(path_), {}); }
    fs::path path_;
};

TEST(MotionCommand, AnswersInJson) {
    const Answer answer = tricoil("motion --example I --loop open --json");
    ASSERT_EQ(answer.exit_code, 0) << answer.output;
    const auto json = nlohmann::json::parse(answer.output);
    EXPECT_NEAR(json["measured"]["max_abs_e_rho_m"], 0.030113, 5e-7);
    EXPECT_NEAR(json["measured"]["max_abs_e_alpha_rad"], 0.019278, 5e-7);
    EXPECT_EQ(json["measured"]["max_abs_e_beta_rad"], 0);
    EXPECT_NEAR(json["predicted"]["max_abs_e_rho_m"], 0.030113, 5e-7);
    EXPECT_TRUE(json["predicted"].contains("final_e_beta_rad"));
}

TEST(MotionCommand, TakesOwnRates) {
    const Answer own = tricoil("motion --elevation 0,31.41592653589793 --range 0.2,0.3 --json");
    const Answer two = tricoil("motion --example II --json");
    ASSERT_EQ(own.exit_code, 0) << own.output;
    EXPECT_EQ(nlohmann::json::parse(own.output)["measured"], nlohmann::json::parse(two.output)["measured"]);
}

TEST(MotionCommand, RefusesBadInputInOneLine) {
    expect_refused("motion", "--example");
    expect_refused("motion --example IIII", "did you mean 'III'?");
    expect_refused("motion --example I --loop opne", "did you mean 'open'?");
    expect_refused("motion --example I --kappa tow", "did you mean 'two'?");
    expect_refused("motion --example I --rate-hz 0", "--rate-hz");
    expect_refused("motion --example I --rate-hz -240", "--rate-hz");
    expect_refused("motion --example I --rate-hz nan", "--rate-hz");
    expect_refused("motion --example I --rate-hz 1e300", "update time");
    expect_refused("motion --azimuth nan,0", "azimuth rate");
    expect_refused("motion --azimuth 1e9,0", "azimuth rate");
    expect_refused("motion --elevation 0,300", "lower the rates");
    expect_refused("motion --range 0,-1", "runs into the source");
    expect_refused("motion --example I --duration 0", "duration");
    expect_refused("motion --example I --out /nonexistent/x.csv", "/nonexistent/x.csv");
}

TEST(SelfcheckCommand, PassesHere) {
    const Answer answer = tricoil("selfcheck --json");
    EXPECT_EQ(answer.exit_code, 0) << answer.output;
    EXPECT_TRUE(nlohmann::json::parse(answer.output)["passed"]);
}

TEST_F(Folder, FiguresRefuseFoldersThatCannotBeWritten) {
    expect_refused("figures --out " + (path_ / "no" / "such").string(), "no/such");
    const fs::path file = path_ / "file";
    std::ofstream(file) << "mine";
    expect_refused("figures --out " + file.string(), "it is a file");
    expect_refused("figures --out /proc/tricoil", "/proc/tricoil");
    EXPECT_EQ(entries(), 1);
}

TEST_F(Folder, FiguresLeaveNothingWhenTheyFail) {
    const fs::path out = path_ / "out";
    expect_refused("figures --out " + out.string() + " --hand-motion " + path_.string(), "no .traj files");
    EXPECT_FALSE(fs::exists(out)) << "half-written";
}

TEST_F(Folder, FiguresWriteTheirNumbers) {
    const fs::path out = path_ / "out";
    const Answer answer = tricoil("figures --csv-only --out " + out.string() + "/");
    ASSERT_EQ(answer.exit_code, 0) << answer.output;
    for (int n = 1; n <= 6; ++n) {
        EXPECT_GT(fs::file_size(out / ("fig" + std::to_string(n) + ".csv")), 100'000U);
    }
    EXPECT_TRUE(fs::exists(out / "budget.csv"));
    for (const auto& entry : fs::directory_iterator(out)) {
        EXPECT_EQ(entry.path().extension(), ".csv") << entry.path();
    }
}

TEST_F(Folder, StagedFolderKeepsOtherFiles) {
    std::ofstream(path_ / "mine.txt") << "mine";
    {
        StagedFolder staged(path_);
        write_whole_file(staged.path() / "a.csv", "a");
    }
    EXPECT_EQ(entries(), 1) << "not published, nothing left";
    {
        StagedFolder staged(path_);
        write_whole_file(staged.path() / "a.csv", "a");
        staged.publish();
    }
    EXPECT_EQ(entries(), 2);
    EXPECT_TRUE(fs::exists(path_ / "mine.txt"));
}

}  // namespace
}  // namespace tricoil::host

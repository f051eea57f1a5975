// Commands `motion` and `figures`: exit codes, one-line error messages, no partially written files.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "board/support/errors.hpp"
#include "board/support/output_file.hpp"
#include "tests/support/temporary_path.hpp"

namespace tricoil::host {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

struct Answer {
    int exit_code = -1;
    std::string output;
};

Answer tricoil(const std::string& arguments) {
    const std::string line = TRICOIL_PROGRAM + (" " + arguments + " 2>&1");
    FILE* pipe = ::popen(line.c_str(), "r");
    Answer answer;
    std::array<char, 4096> buffer{};
    for (std::size_t n = 0; (n = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) {
        answer.output.append(buffer.data(), n);
    }
    answer.exit_code = WEXITSTATUS(::pclose(pipe));
    return answer;
}

std::string text_of(const fs::path& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
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
        path_ = test::path_in_temp("figures");
        fs::remove_all(path_);
        fs::create_directory(path_);
    }
    [[nodiscard]] std::ptrdiff_t entries() const { return std::distance(fs::directory_iterator(path_), {}); }
    fs::path path_;
};

TEST(MotionCommand, WritesJson) {
    const Answer answer = tricoil("motion --example I --loop open --json");
    ASSERT_EQ(answer.exit_code, 0) << answer.output;
    const auto json = nlohmann::json::parse(answer.output);
    EXPECT_NEAR(json["measured"]["max_abs_e_rho_m"], 0.030113, 5e-7);
    EXPECT_NEAR(json["measured"]["max_abs_e_alpha_rad"], 0.019278, 5e-7);
    EXPECT_EQ(json["measured"]["max_abs_e_beta_rad"], 0);
    EXPECT_NEAR(json["predicted"]["max_abs_e_rho_m"], 0.030113, 5e-7);
    EXPECT_TRUE(json["predicted"].contains("final_e_beta_rad"));
}

TEST(MotionCommand, AcceptsUserRates) {
    const Answer own = tricoil("motion --elevation 0,31.41592653589793 --range 0.2,0.3 --json");
    const Answer two = tricoil("motion --example II --json");
    ASSERT_EQ(own.exit_code, 0) << own.output;
    EXPECT_EQ(nlohmann::json::parse(own.output)["measured"], nlohmann::json::parse(two.output)["measured"]);
}

TEST(MotionCommand, RefusesBadInputInOneLine) {
    expect_refused("motion", "--example");
    expect_refused("motion --example orientatoin", "did you mean 'orientation'?");
    expect_refused("motion --example IIII", "unknown example 'IIII'; choices: I, II, III,");  // equally near to III and IIIo
    expect_refused("motion --example I --loop opne", "did you mean 'open'?");
    expect_refused("motion --example I --kappa tow", "did you mean 'two'?");
    expect_refused("motion --example I --rate-hz 0", "--rate-hz");
    expect_refused("motion --example I --rate-hz -240", "--rate-hz");
    expect_refused("motion --example I --rate-hz nan", "--rate-hz");
    expect_refused("motion --example I --rate-hz 1e300", "--rate-hz must be 1 to 100000; got 1e+300");
    expect_refused("motion --example I --rate-hz 1e-9", "--rate-hz must be 1 to 100000; got 1e-09");
    expect_refused("motion --example I --rate-hz inf", "--rate-hz must be 1 to 100000; got inf");
    expect_refused("motion --example I --start-range 1e300", "--start-range must be");
    expect_refused("motion --example I --start-range 1e-300", "--start-range must be");
    expect_refused("motion --example I --gap -0.001", "--gap must be");
    expect_refused("motion --example I --kappa two --form vectors --loop closed", "use --kappa exact with the pole-free form");
    expect_refused("motion --example I --out ''", "--out");
    expect_refused("motion --azimuth nan,0", "azimuth rate");
    expect_refused("motion --azimuth 1e9,0", "azimuth rate");
    expect_refused("motion --elevation 0,300", "lower the rates");
    expect_refused("motion --range 0,-1", "reaches the source");
    expect_refused("motion --example I --duration 0", "duration");
    expect_refused("motion --example I --out /nonexistent/x.csv", "/nonexistent/x.csv");
}

nlohmann::json motion(const std::string& arguments) {
    const Answer answer = tricoil("motion --json " + arguments);
    EXPECT_EQ(answer.exit_code, 0) << answer.output;
    return nlohmann::json::parse(answer.output);
}

/// The error of one pass is mainly in range. It agrees with (37), evaluated for the turn in one update.
TEST(MotionCommand, PredictsThePoleFreeLoop) {
    const auto one = motion("--example III --loop closed --form vectors");
    EXPECT_NEAR(one["measured"]["max_abs_e_rho_m"], 0.018056, 5e-7);
    EXPECT_NEAR(one["predicted"]["max_abs_e_rho_m"], one["measured"]["max_abs_e_rho_m"], 1e-12);
    EXPECT_LT(one["max_abs_predicted_minus_measured"]["e_alpha_rad"], 1e-10);
    EXPECT_NEAR(one["max_position_error_m"], 0.018153, 5e-7);
    EXPECT_NEAR(one["predicted_max_position_error_m"], 0.018153, 5e-7);
    EXPECT_FALSE(one.contains("singularities")) << "the pole-free form has none";
    const auto two = motion("--example III --loop closed --form vectors --passes 2");
    EXPECT_NEAR(two["predicted_max_position_error_m"], 5.46e-7, 1e-9);
    EXPECT_THAT(tricoil("motion --example III --loop closed --form vectors").output,
                HasSubstr("position error at most 18.1532 mm (predicted 18.1532)"));
}

TEST(MotionCommand, PrintsNoPredictionOutsideItsDomain) {
    const auto json = motion("--example III --loop closed --passes 2");
    for (const char* key :
         {"predicted", "max_abs_predicted_minus_measured", "predicted_max_position_error_m", "singularities", "exact_step"}) {
        EXPECT_FALSE(json.contains(key)) << key;
    }
    EXPECT_TRUE(json.contains("measured"));
    const std::string text = tricoil("motion --example III --loop closed --passes 2").output;
    EXPECT_THAT(text, HasSubstr("no prediction"));
    EXPECT_THAT(text, testing::Not(HasSubstr("singular instants")));
    EXPECT_THAT(text, testing::Not(HasSubstr("\n  predicted")));
}

/// Remark 4: a gap only makes the update longer.
TEST(MotionCommand, AGapLengthensTheUpdate) {
    const auto gap = motion("--example I --gap 0.0015 --duration 2");
    const auto slower = motion("--example I --rate-hz 176.47058823529412 --duration 2");  // 1 / (1/240 + 0.0015)
    EXPECT_NEAR(gap["update_s"], 1.0 / 240 + 0.0015, 1e-15);
    EXPECT_NEAR(gap["measured"]["max_abs_e_rho_m"], slower["measured"]["max_abs_e_rho_m"], 1e-9);
    EXPECT_GT(gap["measured"]["max_abs_e_rho_m"], motion("--example I --duration 2")["measured"]["max_abs_e_rho_m"]);
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

TEST_F(Folder, FiguresLeaveNoFilesAfterAFailure) {
    const fs::path out = path_ / "out";
    expect_refused("figures --out " + out.string() + " --hand-motion " + path_.string(), "no .traj files");
    EXPECT_FALSE(fs::exists(out)) << "partially written";
}

TEST_F(Folder, FiguresWriteTheirNumbers) {
    const fs::path out = path_ / "out";
    const Answer answer = tricoil("figures --csv-only --out " + out.string() + "/");
    ASSERT_EQ(answer.exit_code, 0) << answer.output;
    for (const char* name : {"fig1", "fig2", "fig2_kappa_2", "fig3", "fig4", "fig5", "fig5_changed", "fig6"}) {
        EXPECT_GT(fs::file_size(out / (std::string(name) + ".csv")), 60'000U) << name;
    }
    EXPECT_TRUE(fs::exists(out / "budget.csv"));
    EXPECT_NE(answer.output.find("/fig1.csv\n"), std::string::npos) << answer.output;
    EXPECT_EQ(answer.output.find(".svg"), std::string::npos) << answer.output;
    // Strong skin effect (Landau and Lifshitz, Electrodynamics of Continuous Media, section 59): -(1 - 3 delta / 2 a) in phase.
    // Copper, 0.1 MHz: delta = 0.206 mm; a = 20 mm.
    const std::string response = text_of(out / "metal_response.csv");
    ASSERT_THAT(response, testing::StartsWith("frequency_hz,copper_in_phase,copper_quadrature,"));
    const std::string last = response.substr(response.rfind('\n', response.size() - 2) + 1);
    EXPECT_NEAR(std::stod(last), 1e5, 1);
    EXPECT_NEAR(std::stod(last.substr(last.find(',') + 1)), -(1 - 1.5 * 0.206 / 20), 1e-3) << last;
    for (const auto& entry : fs::directory_iterator(out)) {
        EXPECT_EQ(entry.path().extension(), ".csv") << entry.path();
    }
}

TEST_F(Folder, FiguresDrawThem) {
    if (std::system("/usr/bin/python3 -c 'import matplotlib' >/dev/null 2>&1") != 0) {
        GTEST_SKIP() << "matplotlib is not installed";
    }
    const fs::path out = path_ / "out";
    const Answer answer = tricoil("figures --out " + out.string());
    ASSERT_EQ(answer.exit_code, 0) << answer.output;
    for (const char* name : {"fig1", "fig2", "fig3", "fig4", "fig5", "fig6", "loops", "budget", "metal"}) {
        const std::string svg = text_of(out / (std::string(name) + ".svg"));
        EXPECT_THAT(svg, HasSubstr("</svg>")) << name;
        EXPECT_THAT(svg, HasSubstr("<path")) << name;
        EXPECT_THAT(answer.output, HasSubstr(std::string(name) + ".svg"));
    }
    EXPECT_THAT(text_of(out / "fig1.svg"), HasSubstr("<!-- $e_α$ (rad) -->"));
    for (const auto& entry : fs::directory_iterator(out)) {
        EXPECT_THAT(entry.path().extension(), testing::AnyOf(fs::path(".csv"), fs::path(".svg"))) << entry.path();
    }
}

/// Nothing of the current folder is imported, and no settings are read from there.
TEST_F(Folder, FiguresRunNoFileOfTheCurrentFolder) {
    for (const char* name : {"matplotlib.py", "numpy.py", "csv.py", "_draw.py", "sitecustomize.py"}) {
        std::ofstream(path_ / name) << "open('" << (path_ / "ran").string() << "', 'w')\n";
    }
    const std::string line = "cd " + path_.string() + " && PYTHONPATH=. " + TRICOIL_PROGRAM + " figures --out out >/dev/null";
    EXPECT_EQ(std::system(line.c_str()), 0);
    EXPECT_FALSE(fs::exists(path_ / "ran"));
}

TEST_F(Folder, FiguresReplaceRegularFilesOnly) {
    const fs::path out = path_ / "out";
    fs::create_directory(out);
    ASSERT_EQ(::mkfifo((out / "fig3.csv").c_str(), 0600), 0);
    expect_refused("figures --csv-only --out " + out.string(), "fig3.csv: not a regular file");
    EXPECT_TRUE(fs::is_fifo(out / "fig3.csv"));
    EXPECT_EQ(std::distance(fs::directory_iterator(out), {}), 1) << "partially published";
    expect_refused("figures --out ''", "--out");
}

TEST_F(Folder, AWholeFileFollowsASymbolicLink) {
    write_whole_file(path_ / "real", "old");
    fs::create_directory(path_ / "sub");
    fs::create_symlink("../real", path_ / "sub" / "link");
    write_whole_file(path_ / "sub" / "link", "new");
    EXPECT_TRUE(fs::is_symlink(path_ / "sub" / "link"));
    EXPECT_EQ(text_of(path_ / "real"), "new");
    fs::create_symlink("not-yet", path_ / "dangling");
    write_whole_file(path_ / "dangling", "made");
    EXPECT_TRUE(fs::is_symlink(path_ / "dangling"));
    EXPECT_EQ(text_of(path_ / "not-yet"), "made");
    fs::create_symlink("loop", path_ / "loop");
    EXPECT_THROW(write_whole_file(path_ / "loop", "x"), InputError);
}

TEST_F(Folder, AWholeFileIsWrittenDirectlyIntoAPipe) {
    const fs::path fifo = path_ / "fifo";
    ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
    std::string read;
    std::thread reader([&] { read = text_of(fifo); });
    write_whole_file(fifo, "text");
    EXPECT_TRUE(fs::is_fifo(fifo));
    if (!fs::is_fifo(fifo)) {  // the FIFO was replaced: release the reader
        fs::remove(fifo);
        reader.detach();
        return;
    }
    reader.join();
    EXPECT_EQ(read, "text");
}

TEST_F(Folder, AWholeFileKeepsAndObeysPermissions) {
    const fs::path file = path_ / "file";
    write_whole_file(file, "old");
    fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
    write_whole_file(file, "new");
    EXPECT_EQ(fs::status(file).permissions(), fs::perms::owner_read | fs::perms::owner_write);
    fs::permissions(file, fs::perms::owner_read);
    EXPECT_THROW(write_whole_file(file, "newer"), InputError);
    EXPECT_EQ(text_of(file), "new");
    EXPECT_THROW(write_whole_file(path_, "a folder"), InputError);
    EXPECT_EQ(entries(), 1);
}

/// Through a symbolic link, so that a bug can replace only the link.
TEST_F(Folder, StandardOutputTakesCsvAndSummary) {
    const std::string out = (path_ / "stdout").string();
    fs::create_symlink("/proc/self/fd/1", out);
    const Answer answer = tricoil("motion --example I --duration 0.1 --out " + out);  // a pipe, here
    EXPECT_EQ(answer.exit_code, 0) << answer.output;
    EXPECT_THAT(answer.output, HasSubstr("time_s,stamp_us"));
    EXPECT_THAT(answer.output, HasSubstr("position error at most"));
    const std::string line =
        std::string(TRICOIL_PROGRAM) + " motion --example I --duration 0.1 --out " + out + " >" + (path_ / "both").string();
    ASSERT_EQ(std::system(line.c_str()), 0);
    EXPECT_THAT(text_of(path_ / "both"), HasSubstr("time_s,stamp_us"));
    EXPECT_THAT(text_of(path_ / "both"), HasSubstr("position error at most"));
}

}  // namespace
}  // namespace tricoil::host

// Interrupts: a run ends with summary, complete CSV and coils off; an interrupted `figures` leaves no files.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

/// Starts a run of 100,000 simulated seconds, interrupts it after its CSV file has begun to grow, aside, and returns its exit
/// code.
int interrupt_run(int signal, const std::string& csv, const std::string& out) {
    const pid_t child = fork();
    if (child == 0) {
        dup2(open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO);
        execl(TRICOIL_PROGRAM, TRICOIL_PROGRAM, "run", "--json", "--duration", "100000", "--out", csv.c_str(), nullptr);
        _exit(127);
    }
    const std::string aside = csv + ".part-" + std::to_string(child);
    std::error_code error;
    std::uintmax_t size = 0;
    for (int i = 0; i < 1000 && (error || size < 10'000); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        size = std::filesystem::file_size(aside, error);
    }
    EXPECT_FALSE(error) << aside;
    kill(child, signal);
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(Interrupt, EndsARunWithCompleteOutput) {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        const std::string csv = path_in_temp("interrupted.csv");
        const std::string out = path_in_temp("interrupted.json");
        std::filesystem::remove(csv);
        ASSERT_EQ(interrupt_run(signal, csv, out), 0);
        const auto json = nlohmann::json::parse(read_file(out));
        EXPECT_TRUE(json["interrupted"]);
        EXPECT_TRUE(json["coils_off"]);
        const std::string text = read_file(csv);
        EXPECT_EQ(text.back(), '\n');
        const auto columns = std::count(text.begin(), text.begin() + static_cast<long>(text.find('\n')), ',');
        const auto last_line = text.substr(text.rfind('\n', text.size() - 2) + 1);
        EXPECT_EQ(std::count(last_line.begin(), last_line.end(), ','), columns);
    }
}

namespace fs = std::filesystem;

class FiguresInterrupted : public ::testing::Test {
protected:
    void SetUp() override {
        fs::remove_all(folder_);
        fs::create_directory(folder_);
    }

    [[nodiscard]] pid_t start() const {
        const pid_t child = fork();
        if (child == 0) {
            dup2(open(err_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
            execl(TRICOIL_PROGRAM, TRICOIL_PROGRAM, "figures", "--out", out_.c_str(), nullptr);
            _exit(127);
        }
        return child;
    }

    /// False if the condition stays false for 60 s.
    template <typename Condition>
    static bool wait_for(Condition condition) {
        for (int i = 0; i < 6000; ++i) {
            if (condition()) {
                return true;
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        return false;
    }

    static int end(pid_t child, int signal) {
        kill(child, signal);
        int status = 0;
        waitpid(child, &status, 0);
        return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    }

    /// The first table proves that simulations are running, the first picture that another process draws.
    [[nodiscard]] bool has_begun(const char* extension = ".csv") const {
        std::error_code error;
        for (const auto& entry : fs::recursive_directory_iterator(out_, error)) {
            if (entry.path().extension() == extension && entry.path().string().find("/.unfinished-") != std::string::npos) {
                return true;
            }
        }
        return false;
    }

    /// Processes whose working folder is below the output folder, also if it was removed: the one that draws.
    [[nodiscard]] int drawing_processes() const {
        int count = 0;
        std::error_code error;
        for (const auto& process : fs::directory_iterator("/proc")) {
            const fs::path place = fs::read_symlink(process.path() / "cwd", error);  // not of a process that has ended
            count += !error && place.string().starts_with(out_ + "/.unfinished-") ? 1 : 0;
        }
        return count;
    }

    const std::string folder_ = path_in_temp("figures_interrupted");
    const std::string out_ = folder_ + "/out";
    const std::string err_ = folder_ + "/err.txt";
};

TEST_F(FiguresInterrupted, LeaveNoFiles) {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        const pid_t child = start();
        ASSERT_TRUE(wait_for([this] { return has_begun(); }));
        EXPECT_EQ(end(child, signal), 128 + signal);
        EXPECT_FALSE(fs::exists(out_)) << signal;
        EXPECT_EQ(read_file(err_), "tricoil: interrupted; nothing was written\n");
    }
}

TEST_F(FiguresInterrupted, KeepExistingFiles) {
    fs::create_directory(out_);
    std::ofstream(out_ + "/fig1.csv") << "mine";
    const pid_t child = start();
    ASSERT_TRUE(wait_for([this] { return has_begun(); }));
    EXPECT_EQ(end(child, SIGINT), 128 + SIGINT);
    EXPECT_EQ(read_file(out_ + "/fig1.csv"), "mine");
    EXPECT_EQ(std::distance(fs::directory_iterator(out_), {}), 1);
}

TEST_F(FiguresInterrupted, LeaveNoFilesWhileTheyAreDrawn) {
    const pid_t child = start();
    ASSERT_TRUE(wait_for([this] { return has_begun(".svg"); }));
    EXPECT_EQ(drawing_processes(), 1);
    EXPECT_EQ(end(child, SIGTERM), 128 + SIGTERM);
    EXPECT_EQ(drawing_processes(), 0);
    EXPECT_FALSE(fs::exists(out_));
}

TEST_F(FiguresInterrupted, RemoveFilesOfAKilledRun) {
    const pid_t killed = start();
    ASSERT_TRUE(wait_for([this] { return has_begun(); }));
    EXPECT_EQ(end(killed, SIGKILL), -SIGKILL);
    ASSERT_TRUE(fs::exists(out_ + "/.unfinished-" + std::to_string(killed)));
    const pid_t next = start();
    EXPECT_TRUE(wait_for([&] { return !fs::exists(out_ + "/.unfinished-" + std::to_string(killed)); }));
    EXPECT_EQ(end(next, SIGINT), 128 + SIGINT);
    EXPECT_TRUE(fs::is_empty(out_));
}

}  // namespace
}  // namespace tricoil::test

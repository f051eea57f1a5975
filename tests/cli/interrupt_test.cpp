// Ctrl-C in the middle of a run: summary, complete CSV, coils off.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <thread>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

/// Starts a run that would last for hours, interrupts it once the CSV has begun to grow, and returns its exit code.
int interrupt_run(int signal, const std::string& csv, const std::string& out) {
    const pid_t child = fork();
    if (child == 0) {
        dup2(open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO);
        execl(TRICOIL_PROGRAM, TRICOIL_PROGRAM, "run", "--json", "--duration", "100000", "--out", csv.c_str(), nullptr);
        _exit(127);
    }
    for (int i = 0; i < 1000; ++i) {
        std::error_code error;
        if (std::filesystem::file_size(csv, error) > 10'000 && !error) {
            break;
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    kill(child, signal);
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(Interrupt, EndsInOrder) {
    for (const int signal : {SIGINT, SIGTERM}) {
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

}  // namespace
}  // namespace tricoil::test

// Programs that a test starts in the background.
#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <string>

#include "tests/drivers/shell.hpp"

extern char** environ;  // NOLINT(readability-identifier-naming): the system's own name

namespace tricoil::test {

/// Shell command in the background. The destructor kills it if it still runs.
class Program {
public:
    explicit Program(const std::string& command) {
        const std::string line = "exec " + command;
        std::array<char*, 4> arguments{const_cast<char*>("sh"), const_cast<char*>("-c"), const_cast<char*>(line.c_str()),
                                       nullptr};
        EXPECT_EQ(::posix_spawn(&pid_, "/bin/sh", nullptr, nullptr, arguments.data(), environ), 0) << command;
    }
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;
    ~Program() {
        if (pid_ > 0) {
            send(SIGKILL);
            wait();
        }
    }

    [[nodiscard]] pid_t pid() const { return pid_; }
    void send(int signal) const { ::kill(pid_, signal); }

    /// Waits for the exit code: 128 + signal if a signal ended it.
    int wait() {
        int status = 0;
        ::waitpid(pid_, &status, 0);
        pid_ = -1;
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }

private:
    pid_t pid_ = -1;
};

}  // namespace tricoil::test

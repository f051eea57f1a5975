// Runs the tricoil program on a terminal (pseudo terminal), and types at it.
#pragma once

#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <string>
#include <vector>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {

/// Keys to type after a text has appeared. "\x03" is Ctrl-C.
struct Typed {
    std::string after;
    std::string keys;
};

/// Everything that `tricoil ARGUMENTS` wrote to a terminal of `columns` columns, in `out`; lines end with "\r\n".
inline CliResult tricoil_on_terminal(const std::string& arguments, unsigned short columns, const std::string& setup = ":",
                                     const std::vector<Typed>& typed = {}) {
    const std::string command = setup + "; " + TRICOIL_PROGRAM + " " + arguments;
    winsize size{24, columns, 0, 0};
    int terminal = -1;
    const pid_t child = ::forkpty(&terminal, nullptr, nullptr, &size);
    if (child == 0) {
        ::setenv("TERM", "xterm", 1);
        ::unsetenv("NO_COLOR");
        ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
        ::_exit(127);
    }
    CliResult result;
    std::size_t next = 0;
    std::size_t seen = 0;  // where the search for the next text begins
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    std::array<char, 4096> buffer{};
    while (std::chrono::steady_clock::now() < deadline) {
        pollfd ready{terminal, POLLIN, 0};
        if (::poll(&ready, 1, 1000) == 1) {
            const auto count = ::read(terminal, buffer.data(), buffer.size());
            if (count <= 0) {  // EIO: the program has ended
                break;
            }
            result.out.append(buffer.data(), static_cast<std::size_t>(count));
        }
        const auto at = next < typed.size() ? result.out.find(typed[next].after, seen) : std::string::npos;
        if (at != std::string::npos) {
            seen = at + typed[next].after.size();
            (void)!::write(terminal, typed[next].keys.data(), typed[next].keys.size());
            ++next;
        }
    }
    ::kill(child, SIGKILL);  // no effect on a program that has ended and waits for waitpid()
    int status = 0;
    ::waitpid(child, &status, 0);
    ::close(terminal);
    result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return result;
}

/// Longest line on the terminal, in bytes without colours. A carriage return begins a line too.
inline std::size_t longest_line(const std::string& text) {
    std::size_t longest = 0;
    std::size_t length = 0;
    for (std::size_t at = 0; at < text.size(); ++at) {
        if (text[at] == '\x1b') {
            at = std::min(text.find_first_of("mK", at), text.size());
        } else if (text[at] == '\r' || text[at] == '\n') {
            length = 0;
        } else {
            longest = std::max(longest, ++length);
        }
    }
    return longest;
}

}  // namespace tricoil::test

// Runs `tricoil serve` for a test, and connects clients to it.
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {

using Clock = std::chrono::steady_clock;

/// The program; runs until the end of this object's lifetime. standard_error: its descriptor; -1: a file.
class Serving {
public:
    explicit Serving(const std::vector<std::string>& options, int standard_error = -1) {
        std::array<int, 2> out{};
        EXPECT_EQ(pipe(out.data()), 0);
        pid_ = fork();
        if (pid_ == 0) {
            dup2(out[1], STDOUT_FILENO);
            dup2(standard_error >= 0 ? standard_error : open(err_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
            std::vector<std::string> all{TRICOIL_PROGRAM, "serve", "--json"};
            all.insert(all.end(), options.begin(), options.end());
            std::vector<char*> arguments;
            for (std::string& argument : all) {
                arguments.push_back(argument.data());
            }
            arguments.push_back(nullptr);
            execv(TRICOIL_PROGRAM, arguments.data());
            _exit(127);
        }
        close(out[1]);
        std::string line;
        for (char c = 0; read(out[0], &c, 1) == 1 && c != '\n';) {
            line += c;
        }
        close(out[0]);
        addresses_ = nlohmann::json::parse(line, nullptr, false);
    }
    ~Serving() {
        if (pid_ > 0) {
            stop(SIGKILL);
        }
    }
    int stop(int signal) {
        kill(std::exchange(pid_, -1), signal);
        int status = 0;
        wait(&status);
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    [[nodiscard]] std::string address(const char* output) const {
        const auto& at = addresses_[output];
        return at.is_array() ? at[0].get<std::string>() : at.get<std::string>();
    }
    [[nodiscard]] std::uint16_t port(const char* output) const {
        const std::string address = this->address(output);
        return static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
    }
    [[nodiscard]] std::string path() const { return addresses_["fastrak"][0]; }
    [[nodiscard]] std::string err() const { return read_file(err_); }

private:
    pid_t pid_ = -1;
    std::string err_ = path_in_temp("serving_err.txt");
    nlohmann::json addresses_;
};

/// from: address of the client.
inline int connect_to(std::uint16_t port, int receive_buffer = 0, in_addr_t from = INADDR_LOOPBACK) {
    const int client = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (receive_buffer > 0) {
        setsockopt(client, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    }
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(from);
    EXPECT_EQ(bind(client, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);  // NOLINT: socket API
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(client, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);  // NOLINT: socket API
    return client;
}

/// Receives until `enough` bytes have arrived, at most for `limit`.
inline std::string read_for(int descriptor, std::chrono::milliseconds limit, std::size_t enough = SIZE_MAX) {
    std::string text;
    const auto end = Clock::now() + limit;
    std::array<char, 4096> buffer{};
    while (text.size() < enough && Clock::now() < end) {
        pollfd waiting{descriptor, POLLIN, 0};
        if (poll(&waiting, 1, 20) > 0) {
            const ssize_t n = read(descriptor, buffer.data(), buffer.size());
            if (n <= 0) {
                break;
            }
            text.append(buffer.data(), static_cast<std::size_t>(n));
        }
    }
    return text;
}

/// UDP socket on a free port of the loopback interface.
class UdpReceiver {
public:
    UdpReceiver() {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t size = sizeof address;
        EXPECT_EQ(bind(socket_, reinterpret_cast<sockaddr*>(&address), size), 0);          // NOLINT: socket API
        EXPECT_EQ(getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size), 0);  // NOLINT
        port_ = std::to_string(ntohs(address.sin_port));
    }
    UdpReceiver(const UdpReceiver&) = delete;
    UdpReceiver& operator=(const UdpReceiver&) = delete;
    ~UdpReceiver() { close(socket_); }

    [[nodiscard]] const std::string& port() const { return port_; }
    /// Next datagram; empty after 10 s without one.
    [[nodiscard]] std::string datagram() const { return read_for(socket_, std::chrono::seconds(10), 1); }

private:
    int socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    std::string port_;
};

}  // namespace tricoil::test

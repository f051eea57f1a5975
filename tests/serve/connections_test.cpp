// Rules of connections that hold for every TCP output: no client shuts out others, dead ones end, and no page of a browser has
// access or gives commands.
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <thread>

#include "tests/serve/serving.hpp"
#include "tests/support/instrumented.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr in_addr_t kOtherAddress = 0x7f000002;  // 127.0.0.2
constexpr in_addr_t kThirdAddress = 0x7f000003;

struct Output {
    const char* name;
    const char* option;
    const char* where;
    const char* opening;        // what a client sends to get poses
    bool has_handshake = true;  // clients that do not complete it are disconnected
};
const std::vector<Output> kOutputs{
    {"fastrak", "--fastrak", "tcp:0", "C", false},
    {"openigtlink", "--openigtlink", "0", "", false},
    {"json_lines", "--json-lines", "tcp:0", "", false},
    {"websocket", "--websocket", "0",
     "GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
     "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"},
    {"web", "--web", "0", "GET /stream HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\n\r\n"},
};

std::vector<std::string> serve_words() {
    std::vector<std::string> words{"--scenario", "still"};
    for (const Output& output : kOutputs) {
        words.insert(words.end(), {output.option, output.where});
    }
    return words;
}

/// A program with all outputs for TCP clients.
class EveryOutput : public ::testing::Test {
protected:
    [[nodiscard]] std::uint16_t port(const Output& output) const { return serving_.port(output.name); }

    void send_to(int client, const Output& output, std::string text) const {
        if (const auto at = text.find("PORT"); at != std::string::npos) {
            text.replace(at, 4, std::to_string(port(output)));
        }
        (void)send(client, text.data(), text.size(), MSG_NOSIGNAL);
    }

    /// A client that has requested poses and reads nothing.
    int silent(const Output& output, in_addr_t from = INADDR_LOOPBACK) {
        constexpr int kSmallBuffer = 2048;
        clients_.push_back(connect_to(port(output), kSmallBuffer, from));
        send_to(clients_.back(), output, output.opening);
        return clients_.back();
    }

    /// True if a new client gets poses: more bytes than any answer to its request has. A test may be slow, so it tries again.
    [[nodiscard]] bool serves(const Output& output) const {
        constexpr std::size_t kPoses = 2000;
        const auto end = Clock::now() + kSlowdown * std::chrono::seconds(20);
        while (Clock::now() < end) {
            const int client = connect_to(port(output));
            send_to(client, output, output.opening);
            const std::string text = read_for(client, kSlowdown * std::chrono::seconds(5), kPoses);
            close(client);
            if (text.size() >= kPoses) {
                return true;
            }
        }
        return false;
    }

    void expect_room_beside_silent_clients(const std::vector<in_addr_t>& addresses) {
        for (const Output& output : kOutputs) {
            for (const in_addr_t address : addresses) {
                for (int n = 0; n < 16; ++n) {
                    silent(output, address);
                }
            }
        }
        std::this_thread::sleep_for(std::chrono::seconds(3));  // a client that read a moment ago is not replaced
        for (const Output& output : kOutputs) {
            EXPECT_TRUE(serves(output)) << output.name;
        }
    }

    static bool is_connected(int client) {
        std::array<char, 4096> rest{};
        ssize_t n = 1;
        while (n > 0) {
            n = recv(client, rest.data(), rest.size(), MSG_DONTWAIT);
        }
        return n < 0 && errno == EAGAIN;
    }

    void TearDown() override {
        for (const int client : clients_) {
            close(client);
        }
    }

    const Serving serving_{serve_words()};
    std::vector<int> clients_;
};

/// The error of a program without outputs names them all; --osc has no clients.
TEST_F(EveryOutput, IsInTheTable) {
    const std::string error = tricoil("serve").err;
    const auto named = std::count(error.begin(), error.end(), ',') + 2;
    EXPECT_EQ(static_cast<std::size_t>(named), kOutputs.size() + 1) << error;
    for (const Output& output : kOutputs) {
        EXPECT_THAT(error, HasSubstr(output.option));
    }
}

TEST_F(EveryOutput, SilentClientsMakeRoom) {
    expect_room_beside_silent_clients({INADDR_LOOPBACK});
    EXPECT_THAT(serving_.err(), HasSubstr("is disconnected to make room"));
}

TEST_F(EveryOutput, SilentClientsOfManyAddressesMakeRoom) {
    expect_room_beside_silent_clients({kOtherAddress, kThirdAddress});
    EXPECT_THAT(serving_.err(), HasSubstr("refused: limit of 24 clients reached"));
}

TEST_F(EveryOutput, ClientsOfOneAddressLeaveRoomForOthers) {
    for (const Output& output : kOutputs) {
        for (int n = 0; n < 40; ++n) {
            silent(output, kOtherAddress);
        }
        EXPECT_TRUE(serves(output)) << output.name;
    }
}

TEST_F(EveryOutput, AHandshakeEndsWithinFiveSeconds) {
    std::vector<int> clients;
    for (const Output& output : kOutputs) {
        clients.push_back(connect_to(port(output)));
        clients_.push_back(clients.back());
    }
    const auto begin = Clock::now();
    const auto wait_until = [&](std::chrono::seconds time) {
        while (Clock::now() - begin < time) {
            for (std::size_t n = 0; n < kOutputs.size(); ++n) {
                if (kOutputs[n].has_handshake) {
                    send_to(clients[n], kOutputs[n], "x");  // a byte that arrives does not extend the limit
                }
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(200));
        }
    };
    wait_until(std::chrono::seconds(3));
    for (std::size_t n = 0; n < kOutputs.size(); ++n) {
        EXPECT_TRUE(is_connected(clients[n])) << kOutputs[n].name;
    }
    wait_until(std::chrono::seconds(8));
    for (std::size_t n = 0; n < kOutputs.size(); ++n) {
        EXPECT_EQ(is_connected(clients[n]), !kOutputs[n].has_handshake) << kOutputs[n].name;
    }
}

/// Timer of the server's connection to this port of a client, from /proc/net/tcp: 0 none, 1 retransmission, 2 keepalive.
std::string timer_of(std::uint16_t server, std::uint16_t client) {
    std::ifstream table("/proc/net/tcp");
    for (std::string line; std::getline(table, line);) {
        std::istringstream words(line);
        std::string number, local, remote, state, queues, timer;
        words >> number >> local >> remote >> state >> queues >> timer;
        const auto has_port = [](const std::string& address, std::uint16_t port) {
            const auto colon = address.find(':');
            return colon != std::string::npos && std::stoi(address.substr(colon + 1), nullptr, 16) == port;
        };
        if (has_port(local, server) && has_port(remote, client)) {
            return timer.substr(0, 2);
        }
    }
    return "none";
}

TEST_F(EveryOutput, AnIdleConnectionIsProbed) {
    for (const Output& output : kOutputs) {
        const int client = connect_to(port(output));
        sockaddr_in own{};
        socklen_t size = sizeof own;
        ASSERT_EQ(getsockname(client, reinterpret_cast<sockaddr*>(&own), &size), 0);  // NOLINT: socket API
        std::string timer;
        for (int n = 0; n < 200 && timer != "02"; ++n) {
            timer = timer_of(port(output), ntohs(own.sin_port));
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        EXPECT_EQ(timer, "02") << output.name;
        close(client);
    }
}

TEST_F(EveryOutput, RefusesRequestsOfOtherPages) {
    for (const char* site : {"cross-site", "same-site"}) {
        for (const Output& output : kOutputs) {
            std::string request = output.has_handshake ? output.opening : "GET / HTTP/1.1\r\nHost: localhost\r\n\r\n";
            request.insert(request.find("\r\n") + 2, std::string("Sec-Fetch-Site: ") + site + "\r\n");
            const int client = connect_to(port(output));
            send_to(client, output, request);
            const std::string answer = read_for(client, std::chrono::seconds(10), 12);
            EXPECT_THAT(answer, HasSubstr(output.has_handshake ? "HTTP/1.1 403" : "HTTP/1.1 400")) << output.name << ' ' << site;
            close(client);
        }
    }
    EXPECT_THAT(serving_.err(), HasSubstr("refused: it sends an HTTP request"));
}

TEST_F(EveryOutput, ThePageItselfMayStreamAndMayBeLinked) {
    const Output& web = kOutputs.back();
    for (const auto& [path, site] : {std::pair{"/stream", "same-origin"}, {"/stream", "none"}, {"/", "cross-site"}}) {
        const int client = connect_to(port(web));
        send_to(client, web,
                std::string("GET ") + path + " HTTP/1.1\r\nHost: 127.0.0.1:PORT\r\nSec-Fetch-Site: " + site + "\r\n\r\n");
        EXPECT_EQ(read_for(client, std::chrono::seconds(10), 12).substr(0, 12), "HTTP/1.1 200") << path << ' ' << site;
        close(client);
    }
}

/// The system sends them data until their buffers are full, here for 9 s; half of them is unread after 4 s.
TEST(SilentClients, MakeRoomBeforeTheirBuffersAreFull) {
    const Serving serving(std::vector<std::string>{"--scenario", "still", "--mux", "tdm", "--rate-hz", "20", "--sample-rate-hz",
                                                   "43200", "--openigtlink", "0"});
    std::vector<int> clients;
    for (int n = 0; n < 16; ++n) {
        clients.push_back(connect_to(serving.port("openigtlink"), 32768));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(6500));
    clients.push_back(connect_to(serving.port("openigtlink")));
    EXPECT_GT(read_for(clients.back(), std::chrono::seconds(1), 1).size(), 0U);
    std::for_each(clients.begin(), clients.end(), close);
}

/// What a new client of a FASTRAK reads: status, tip, output list, active stations, alignment, mounting frame, limits, reference
/// angles, increment, identification.
std::string settings_of_new_client(const Serving& serving) {
    const int client = connect_to(serving.port("fastrak"));
    const std::string questions = "SN1\rO1\rl1\rA1\rr1\rV1\rQ1\rG1\rI1\rX\r";
    EXPECT_EQ(write(client, questions.data(), questions.size()), std::ssize(questions));
    std::string answers;
    const auto end = Clock::now() + std::chrono::seconds(10);
    while (std::count(answers.begin(), answers.end(), '\n') < 11 && Clock::now() < end) {
        answers += read_for(client, std::chrono::seconds(10), 1);
    }
    close(client);
    const std::size_t flags = answers.find('S');  // the built-in-test field changes with the pose
    return answers.substr(0, flags + 1) + answers.substr(std::min(flags + 7, answers.size()));
}

constexpr const char* kEverySetting =
    "uN1,50,0,0\rO1,2,1\rl1,0\rA1,0,0,0,0,9,0,-9,0,0\rr1,90,0,0\rV1,1,1,1,-1,-1,-1\rQ1,9,9,9,-9,-9,-9\rG1,5,5,5\rI1,"
    "7\rXstranger\r"
    "\x0b";

void change_everything(const Serving& serving) {
    const int client = connect_to(serving.port("fastrak"));
    const std::string commands = std::string(kEverySetting) + "\x19N1\r";  // ^Y restores what ^K saved
    EXPECT_EQ(write(client, commands.data(), commands.size()), std::ssize(commands));
    EXPECT_THAT(read_for(client, std::chrono::seconds(10), 26), HasSubstr("N 50.000  0.000  0.000"));
    close(client);
}

TEST(ServeFastrak, ATcpClientChangesNothingForOthers) {
    for (const char* controls : {"", "--read-only"}) {
        std::vector<std::string> options{"--fastrak", "tcp:0", "--scenario", "still"};
        if (*controls != '\0') {
            options.emplace_back(controls);
        }
        const Serving serving(options);
        const std::string before = settings_of_new_client(serving);
        change_everything(serving);
        EXPECT_EQ(settings_of_new_client(serving), before);
        EXPECT_THAT(before, HasSubstr("N  0.000  0.000  0.000"));
        EXPECT_THAT(serving.err(), HasSubstr("changed settings (u) of its session"));
        EXPECT_THAT(serving.err(), HasSubstr("changed saved settings (^K) of its session"));
    }
}

TEST(ServeFastrak, SavedSettingsAreForAllTcpClientsIfControlsAreOpen) {
    const Serving serving({"--fastrak", "tcp:0", "--scenario", "still", "--open-controls"});
    const std::string before = settings_of_new_client(serving);
    change_everything(serving);
    EXPECT_NE(settings_of_new_client(serving), before);
    EXPECT_THAT(serving.err(), HasSubstr("changed saved settings (^K) for later clients"));
}

TEST(ServeFastrak, APageCannotSendCommandsInARequest) {
    const Serving serving({"--fastrak", "tcp:0", "--scenario", "still", "--open-controls"});
    const std::string before = settings_of_new_client(serving);
    for (const std::size_t portion : {std::size_t{1}, std::size_t{5}, std::size_t{1000}}) {
        const int client = connect_to(serving.port("fastrak"));
        const std::string request = std::string("POST / HTTP/1.1\r\nHost: localhost\r\n\r\n\r") + kEverySetting;
        for (std::size_t at = 0; at < request.size(); at += portion) {
            (void)send(client, request.data() + at, std::min(portion, request.size() - at), MSG_NOSIGNAL);
            std::this_thread::sleep_for(std::chrono::milliseconds(2));
        }
        while (!read_for(client, std::chrono::milliseconds(100)).empty()) {
        }
        close(client);
        EXPECT_EQ(settings_of_new_client(serving), before) << "portions of " << portion;
    }
    EXPECT_THAT(serving.err(), Not(HasSubstr("saved settings")));
}

}  // namespace
}  // namespace tricoil::test

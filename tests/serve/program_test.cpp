// `tricoil serve`: bad input, a hundred clients, and a client that stops reading beside one that reads.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <thread>

#include "board/support/tcp_listener.hpp"
#include "drivers/posix/raw_terminal.hpp"
#include "tests/cli/cli_runner.hpp"
#include "tests/serve/serving.hpp"
#include "tests/support/csv_table.hpp"
#include "tests/support/instrumented.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;

/// The plug is pulled after 2 s and put back after 4 s.
TEST(ServeProgram, ALostSensorIsLogged) {
    const Serving serving({"--json-lines", "tcp:0", "--scenario", "unplugged", "--confined"});
    const auto wait_for = [&](const char* text) {
        const auto end = Clock::now() + std::chrono::seconds(30);
        while (serving.err().find(text) == std::string::npos && Clock::now() < end) {
            std::this_thread::sleep_for(std::chrono::milliseconds(50));
        }
        return serving.err();
    };
    EXPECT_THAT(wait_for("no valid pose"), ::testing::HasSubstr("tricoil: serve: sensor 1: no valid pose: no_sensor"));
    EXPECT_THAT(wait_for("again"), ::testing::HasSubstr("tricoil: serve: sensor 1: valid poses again"));
}

/// A terminal that the user has stopped, or a log that is not read.
TEST(ServeProgram, AStandardErrorThatTakesNothingStopsNoPoses) {
    std::array<int, 2> log{};
    ASSERT_EQ(pipe(log.data()), 0);
    const int size = fcntl(log[1], F_SETPIPE_SZ, 4096);
    const std::string filling(static_cast<std::size_t>(size), 'x');
    ASSERT_EQ(write(log[1], filling.data(), filling.size()), size);
    Serving serving({"--scenario", "still", "--fastrak", "tcp:0", "--json-lines", "tcp:0"}, log[1]);
    const auto cause_notice = [&] {
        const int client = connect_to(serving.port("fastrak"));
        EXPECT_EQ(write(client, "N1,1,0,0\rP", 10), 10);
        EXPECT_FALSE(read_for(client, std::chrono::seconds(10), 1).empty());
        close(client);
    };
    cause_notice();
    const int client = connect_to(serving.port("json_lines"));
    EXPECT_GE(read_for(client, std::chrono::seconds(20), 20'000).size(), 20'000U);
    close(client);
    EXPECT_EQ(read_for(log[0], std::chrono::seconds(10), filling.size()), filling);
    cause_notice();
    EXPECT_THAT(read_for(log[0], std::chrono::seconds(10), 60), HasSubstr("standard error took no text: 1 lines were left out"));
    EXPECT_EQ(serving.stop(SIGINT), 0);
    close(log[0]);
    close(log[1]);
}

TEST(ServeProgram, RefusesInvalidOutputs) {
    const std::vector<std::pair<std::string, std::string>> lines{
        {"", "serve: no output; add --fastrak, "},
        {"--fastrak nowhere", "must be pty, pty:LINK, serial:PATH[:BAUD] or tcp:[ADDRESS:]PORT"},
        {"--fastrak tcp:99999", "needs a port number up to 65535"},
        {"--fastrak serial:/dev/ttyS0:1234", "the speed must be 2400"},
        {"--fastrak pty:/dev/null", "exists and is not a link to a pseudo terminal"},
        {"--fastrak pty:/no/such/folder/link", "cannot be created"},
        {"--openigtlink here", "needs a port number"},
        {"--openigtlink 0 --scenario nonsense", "nonsense"},
        {"--openigtlink 0 --igtl-name ''", "--igtl-name needs a value: TEXT"},
        {"--openigtlink 0 --igtl-name SensorToTrackerOfTheHead", "must have 1 to 20 visible ASCII characters"},
        {"--json-lines tcp:0 --igtl-name SensorToTracker", "--igtl-name: only with --openigtlink"},
    };
    for (const auto& [options, reason] : lines) {
        const auto result = tricoil("serve " + options);
        EXPECT_EQ(result.exit_code, 2) << options;
        EXPECT_THAT(result.err, HasSubstr(reason)) << options;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }
    EXPECT_EQ(tricoil("serve --fastrak serial:/dev/no-such-line").exit_code, 3);
    const Serving first({"--fastrak", "tcp:0"});
    const auto second = tricoil("serve --fastrak tcp:" + std::to_string(first.port("fastrak")));
    EXPECT_EQ(second.exit_code, 3);
    EXPECT_THAT(second.err, HasSubstr("the port is used by another program"));
}

TEST(ServeProgram, APseudoTerminalOutlivesItsClients) {
    const std::string link = path_in_temp("fastrak_link");
    std::filesystem::remove(link);
    std::filesystem::create_symlink("/dev/pts/99999", link);  // link of a program that was killed
    Serving serving({"--fastrak", "pty:" + link, "--scenario", "still"});
    for (int client = 0; client < 3; ++client) {
        const int line = open(link.c_str(), O_RDWR | O_NOCTTY);
        ASSERT_GE(line, 0);
        ASSERT_TRUE(drivers::make_raw(line));
        ASSERT_EQ(write(line, "cFUP", 4), 4);
        const std::string record = read_for(line, std::chrono::seconds(10), 47);
        EXPECT_EQ(record.substr(0, 2), "01") << client;
        EXPECT_EQ(record.size(), 47U) << client;
        ASSERT_EQ(write(line, "C", 1), 1);
        EXPECT_GT(read_for(line, std::chrono::seconds(10), 470).size(), 400U);
        close(line);  // in the middle of the stream
    }
    EXPECT_EQ(serving.stop(SIGTERM), 0);
    EXPECT_FALSE(std::filesystem::exists(std::filesystem::symlink_status(link)));
}

/// Pseudo terminals stand for the port: the device file changes when the adapter is plugged in again.
TEST(ServeProgram, ASerialPortWorksAgainAfterItWasUnplugged) {
    const std::string port = path_in_temp("serial_port");
    const auto plug_in = [&] {
        int master = -1;
        int slave = -1;
        std::array<char, 64> name{};
        EXPECT_EQ(openpty(&master, &slave, name.data(), nullptr, nullptr), 0);
        close(slave);
        EXPECT_EQ(fcntl(master, F_SETFD, FD_CLOEXEC), 0);  // the server must not hold the client's end
        std::filesystem::remove(port);
        std::filesystem::create_symlink(name.data(), port);
        return master;
    };
    const auto has_record = [](int master) {
        pollfd descriptor{master, POLLIN, 0};
        std::array<char, 64> bytes{};
        const auto end = Clock::now() + std::chrono::seconds(20);
        while (Clock::now() < end) {
            if (poll(&descriptor, 1, 100) > 0 && read(master, bytes.data(), bytes.size()) > 0) {
                return true;
            }
        }
        return false;
    };
    const int first = plug_in();
    const Serving serving({"--fastrak", "serial:" + port, "--fastrak-continuous"});
    EXPECT_TRUE(has_record(first));
    close(first);
    const int second = plug_in();
    EXPECT_TRUE(has_record(second));
    close(second);
}

TEST(ServeProgram, AHostNameIsNotTakenForLoopback) {
    EXPECT_TRUE(host::parse_tcp_address("--web", "127.0.0.2:80").is_loopback());
    EXPECT_TRUE(host::parse_tcp_address("--web", "localhost:80").is_loopback());
    EXPECT_FALSE(host::parse_tcp_address("--web", "127.example.org:80").is_loopback());
}

TEST(ServeProgram, TheOutputPortCommandChangesTheSpeedOfASerialPort) {
    const int port = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    ASSERT_EQ(grantpt(port), 0);
    ASSERT_EQ(unlockpt(port), 0);
    const Serving serving({"--fastrak", std::string("serial:") + ptsname(port) + ":9600", "--scenario", "still"});
    const auto waits_for = [&](speed_t speed) {
        termios settings{};
        for (int n = 0; n < 1000 && cfgetospeed(&settings) != speed; ++n) {
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
            tcgetattr(port, &settings);  // of the other end
        }
        return cfgetospeed(&settings) == speed;
    };
    EXPECT_TRUE(waits_for(B9600));
    EXPECT_EQ(write(port, "o192,N,8,0\r", 11), 11);
    EXPECT_TRUE(waits_for(B19200));
    EXPECT_EQ(write(port, "S", 1), 1);
    EXPECT_EQ(read_for(port, std::chrono::seconds(10), 55).size(), 55U);
    EXPECT_EQ(write(port, "\x19", 1), 1);
    EXPECT_TRUE(waits_for(B9600));
    close(port);
}

TEST(ServeProgram, APseudoTerminalInUseIsNotTakenAway) {
    const std::string link = path_in_temp("fastrak_shared");
    std::filesystem::remove(link);
    const Serving first({"--fastrak", "pty:" + link, "--scenario", "still"});
    const auto target = std::filesystem::read_symlink(link);
    const auto second = tricoil("serve --fastrak pty:" + link);
    EXPECT_EQ(second.exit_code, 2);
    EXPECT_THAT(second.err, HasSubstr("which is in use"));
    EXPECT_EQ(std::filesystem::read_symlink(link), target);
}

TEST(ServeProgram, AddressesAreWrittenSoThatClientsCanUseThem) {
    const Serving serving({"--fastrak", "tcp:[::1]:0", "--openigtlink", "[::1]:0", "--web", "[::1]:0", "--scenario", "still"});
    for (const char* output : {"fastrak", "openigtlink"}) {
        EXPECT_THAT(serving.address(output), ::testing::StartsWith("[::1]:"));
    }
    EXPECT_THAT(serving.address("web"), ::testing::StartsWith("http://[::1]:"));
    const Serving open({"--web", "0.0.0.0:0", "--scenario", "still"});
    EXPECT_THAT(open.address("web"), ::testing::StartsWith("http://localhost:"));
}

TEST(ServeProgram, ALaterClientGetsAPoseAtOnce) {
    const Serving serving({"--fastrak", "tcp:0", "--scenario", "still"});
    const int first = connect_to(serving.port("fastrak"));
    EXPECT_EQ(write(first, "C", 1), 1);
    std::string record;
    for (int n = 0; n < 10'000 && record.substr(0, 3) != "01 "; ++n) {  // until the first confirmed pose
        record = read_for(first, std::chrono::seconds(10), 47);
        record = record.substr(record.size() - std::min<std::size_t>(record.size(), 47));
    }
    ASSERT_EQ(record.substr(0, 3), "01 ");
    for (int n = 0; n < 5; ++n) {
        const int client = connect_to(serving.port("fastrak"));
        EXPECT_EQ(write(client, "P", 1), 1);
        EXPECT_EQ(read_for(client, std::chrono::seconds(10), 47).substr(0, 3), "01 ");
        close(client);
    }
    close(first);
}

TEST(ServeProgram, SimulatedStationsAreStationsOfTheFastrak) {
    const Serving serving({"--fastrak", "tcp:0", "--scenario", "still", "--stations", "4"});
    const int client = connect_to(serving.port("fastrak"));
    const auto ask = [&](const char* command, std::size_t size) {
        EXPECT_GT(write(client, command, std::strlen(command)), 0);
        return read_for(client, std::chrono::seconds(10), size);
    };
    std::string records;
    for (int n = 0; n < 1000 && std::count(records.begin(), records.end(), ' ') == 0; ++n) {
        records = ask("P", 4 * 47);  // until the first poses
    }
    EXPECT_EQ(ask("l1\r", 9), "21l1111\r\n");
    EXPECT_EQ(ask("l2,0\rl4,0\rl1\r", 9), "21l1010\r\n");
    records = ask("P", 2 * 47);
    ASSERT_EQ(records.size(), 2 * 47U);
    EXPECT_EQ(records.substr(0, 2), "01");
    EXPECT_EQ(records.substr(47, 2), "03");
    close(client);
}

TEST(ServeProgram, ALateReaderGetsNewRecords) {
    const Serving serving({"--fastrak", "tcp:0", "--fastrak-continuous", "--scenario", "still"});
    const int client = connect_to(serving.port("fastrak"), 2048);
    std::this_thread::sleep_for(std::chrono::seconds(6));  // 120 records of 47 bytes a second
    const std::string text = read_for(client, std::chrono::milliseconds(500));
    EXPECT_LT(text.size(), 3 * 120 * 47U);
    EXPECT_GT(text.size(), 47U);
    close(client);
}

TEST(ServeProgram, ClientsBeyondTheLimitAreRefused) {
    const Serving serving({"--fastrak", "tcp:0", "--scenario", "still"});
    std::vector<int> clients;
    for (int n = 0; n < 100; ++n) {
        clients.push_back(connect_to(serving.port("fastrak")));
        EXPECT_EQ(write(clients.back(), "S", 1), 1);
    }
    std::size_t served = 0;
    for (const int client : clients) {
        served += read_for(client, std::chrono::milliseconds(300), 55).size() == 55U ? 1U : 0U;
    }
    EXPECT_EQ(served, 16U);
    EXPECT_THAT(serving.err(), HasSubstr("refused: limit of 16 clients of one address reached"));
    for (const int client : clients) {
        close(client);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    const int late = connect_to(serving.port("fastrak"));
    EXPECT_EQ(write(late, "S", 1), 1);
    EXPECT_EQ(read_for(late, std::chrono::seconds(10), 55).size(), 55U);
    close(late);
}

/// The tracker lost nothing: the columns of the recording are numbered without gaps.
void expect_every_column(const std::string& folder) {
    const CsvTable inputs(read_file(folder + "/inputs.csv"));
    std::map<long, int> columns;  // columns per sequence number: three in FDM
    for (std::size_t row = 0; row < inputs.rows(); ++row) {
        if (inputs.text(row, "kind") == "column") {
            ++columns[std::stol(inputs.text(row, "sequence"))];
        }
    }
    ASSERT_GT(columns.size(), 360U);
    EXPECT_EQ(columns.rbegin()->first - columns.begin()->first + 1, static_cast<long>(columns.size()));
    columns.erase(std::prev(columns.end()));  // the last record may be incomplete
    EXPECT_TRUE(std::all_of(columns.begin(), columns.end(), [](const auto& frame) { return frame.second == 3; }));
}

TEST(ServeProgram, AStalledClientDoesNotSlowOthers) {
    const std::string folder = path_in_temp("stalled");
    std::filesystem::remove_all(folder);
    Serving serving({"--fastrak", "tcp:0", "--openigtlink", "0", "--scenario", "still", "--record", folder});
    std::vector<int> stalled;
    for (int n = 0; n < 5; ++n) {
        stalled.push_back(connect_to(serving.port("fastrak"), 2048));
        EXPECT_EQ(write(stalled.back(), "O1,52,54,61,52,54,61,1\rC", 24), 24);
        stalled.push_back(connect_to(serving.port("openigtlink"), 2048));
    }
    const int reader = connect_to(serving.port("fastrak"));
    EXPECT_EQ(write(reader, "C", 1), 1);
    (void)read_for(reader, std::chrono::seconds(10), 47);
    const auto begin = Clock::now();
    const std::string text = read_for(reader, kSlowdown * std::chrono::seconds(20), 47 * 360);
    const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
    EXPECT_GE(text.size() / 47, 360U);
    EXPECT_LT(seconds, 10 * kSlowdown);  // three seconds of records, on a machine that may be busy
    EXPECT_EQ(serving.stop(SIGINT), 0);
    expect_every_column(folder);
    for (const int client : stalled) {
        close(client);
    }
    close(reader);
}

/// The page, or the part of it that arrives within `limit`.
std::string get_page(std::uint16_t port, std::chrono::milliseconds limit) {
    const int client = connect_to(port);
    const std::string request = "GET / HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) + "\r\n\r\n";
    EXPECT_EQ(write(client, request.data(), request.size()), static_cast<ssize_t>(request.size()));
    const std::string answer = read_for(client, limit, 1000);
    close(client);
    return answer;
}

TEST(ServeProgram, SlowRequestsDoNotBlockOtherClients) {
    const Serving serving({"--web", "0", "--scenario", "still"});
    std::vector<int> drips;
    for (int n = 0; n < 100; ++n) {
        drips.push_back(connect_to(serving.port("web")));
        EXPECT_GT(send(drips.back(), "GET / HTTP/1.1\r\nHost: ", 22, MSG_NOSIGNAL), 0);
    }
    std::atomic<bool> ends = false;
    std::thread dripping([&] {
        while (!ends) {
            for (const int drip : drips) {
                (void)send(drip, "x", 1, MSG_NOSIGNAL);
            }
            std::this_thread::sleep_for(std::chrono::milliseconds(300));
        }
    });
    std::this_thread::sleep_for(std::chrono::seconds(1));  // until the server waits for all of them
    for (int n = 0; n < 3; ++n) {
        EXPECT_THAT(get_page(serving.port("web"), std::chrono::seconds(10)).substr(0, 15), HasSubstr("200 OK"));
    }
    std::this_thread::sleep_for(std::chrono::seconds(6));  // longer than the time limit of a request
    std::array<char, 4096> rest{};
    for (const int drip : drips) {
        ssize_t n = 1;
        while (n > 0) {
            n = recv(drip, rest.data(), rest.size(), MSG_DONTWAIT);
        }
        EXPECT_TRUE(n == 0 || errno == ECONNRESET) << "still connected";
    }
    ends = true;
    dripping.join();
    for (const int drip : drips) {
        close(drip);
    }
}

TEST(ServeProgram, AHeaderWithoutAnEndIsNotReadToTheEnd) {
    const Serving serving({"--web", "0", "--scenario", "still"});
    const int client = connect_to(serving.port("web"));
    const std::string piece(1 << 16, 'x');
    EXPECT_GT(send(client, "GET / HTTP/1.1\r\nX: ", 19, MSG_NOSIGNAL), 0);
    std::size_t sent = 0;
    constexpr std::size_t kFarTooMuch = 64 << 20;  // more than the buffers of a socket
    for (ssize_t n = 0; n >= 0 && sent < kFarTooMuch; sent += static_cast<std::size_t>(std::max<ssize_t>(n, 0))) {
        n = send(client, piece.data(), piece.size(), MSG_NOSIGNAL);
    }
    EXPECT_LT(sent, kFarTooMuch);
    close(client);
    EXPECT_THAT(get_page(serving.port("web"), std::chrono::seconds(10)).substr(0, 15), HasSubstr("200 OK"));
}

TEST(ServeProgram, HemisphereByACommandIsRecordedAndReplayed) {
    const std::string folder = path_in_temp("hemisphere");
    std::filesystem::remove_all(folder);
    Serving serving({"--fastrak", "tcp:0", "--scenario", "still", "--record", folder, "--open-controls"});
    const int client = connect_to(serving.port("fastrak"));
    const auto x = [&] {
        EXPECT_EQ(write(client, "P", 1), 1);
        return std::stod(read_for(client, std::chrono::seconds(10), 47).substr(3, 7));
    };
    double before = x();
    for (int n = 0; n < 1000 && before == 0; ++n) {  // no pose yet
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
        before = x();
    }
    EXPECT_EQ(write(client, "H1,-1,0,0\r", 10), 10);
    double after = before;
    for (int n = 0; n < 1000 && after * before > 0; ++n) {
        after = x();
    }
    EXPECT_NEAR(after, -before, 0.2);
    EXPECT_EQ(serving.stop(SIGINT), 0);
    EXPECT_THAT(read_file(folder + "/events.csv"), HasSubstr("hemisphere,-1 0 0"));
    EXPECT_TRUE(tricoil("replay --json " + folder).json()["bit_for_bit"]);
    close(client);
}

}  // namespace
}  // namespace tricoil::test

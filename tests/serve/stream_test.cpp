// Stream to a client that reads slowly, does not read, or has disconnected.
#include "board/host/serve/stream.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>

#include <netinet/in.h>
#include <netinet/tcp.h>

#include <array>
#include <csignal>
#include <optional>
#include <thread>

#include "board/host/serve/web/page_output.hpp"
#include "board/support/errors.hpp"
#include "board/support/tcp_listener.hpp"
#include "tests/serve/serving.hpp"

namespace tricoil::host {
namespace {

class StreamPair : public ::testing::Test {
protected:
    void SetUp() override {
        std::signal(SIGPIPE, SIG_IGN);
        std::array<int, 2> ends{};
        ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()), 0);
        stream_.emplace(ends[0]);
        client_.reset(ends[1]);
    }
    std::string read_all() {
        std::string text;
        std::array<char, 4096> buffer{};
        for (ssize_t n = 0; (n = ::recv(client_.get(), buffer.data(), buffer.size(), MSG_DONTWAIT)) > 0;) {
            text.append(buffer.data(), static_cast<std::size_t>(n));
        }
        return text;
    }
    std::optional<Stream> stream_;
    drivers::FileDescriptor client_;
};

TEST_F(StreamPair, AClientThatStopsReadingMissesWholeRecords) {
    const std::string record = std::string(996, 'x') + "end\n";
    std::size_t taken = 0;
    for (int n = 0; n < 2000; ++n) {
        taken += stream_->send(record) ? 1U : 0U;
    }
    EXPECT_EQ(taken + stream_->dropped(), 2000U);
    EXPECT_GT(stream_->dropped(), 0U);
    EXPECT_LE(stream_->waiting(), Stream::kMaxWaiting);
    std::string text;
    for (int n = 0; n < 1000 && stream_->has_waiting(); ++n) {
        text += read_all();
        stream_->flush();
    }
    text += read_all();
    EXPECT_EQ(text.size(), taken * record.size());
    EXPECT_TRUE(stream_->send(record));
    EXPECT_EQ(read_all(), record);
}

TEST_F(StreamPair, OldRecordsAreDropped) {
    SetUp();
    std::array<int, 2> ends{};
    ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()), 0);
    constexpr std::chrono::milliseconds kOldest(50);
    stream_.emplace(ends[0], StreamLimits{kOldest, 4096});
    client_.reset(ends[1]);
    const std::string old = std::string(996, 'x') + "old\n";
    for (int n = 0; n < 200; ++n) {
        stream_->send(old);
    }
    EXPECT_TRUE(stream_->has_waiting());
    std::this_thread::sleep_for(kOldest + std::chrono::milliseconds(20));
    std::string text = read_all();
    const std::size_t held_by_the_socket = text.size();
    EXPECT_LT(held_by_the_socket, 20'000U);
    EXPECT_TRUE(stream_->send("new\n"));
    for (int n = 0; n < 10; ++n) {
        text += read_all();
        stream_->flush();
    }
    // The rest of the record in progress is sent, and nothing of the other records.
    EXPECT_LE(text.size(), held_by_the_socket + old.size() + 4);
    EXPECT_EQ((text.size() - 4) % old.size(), 0U);
    EXPECT_EQ(text.substr(text.size() - 4), "new\n");
    EXPECT_GT(stream_->dropped(), 0U);
}

TEST_F(StreamPair, DisconnectedClientIsDetected) {
    EXPECT_TRUE(stream_->receive().empty());
    EXPECT_FALSE(stream_->gone());
    client_.reset();
    EXPECT_TRUE(stream_->receive().empty());
    EXPECT_TRUE(stream_->gone());
    EXPECT_FALSE(stream_->send("late"));
}

/// A flood must not delay other clients: at most 12 kB/s are read, about the 11.5 kB/s of a line at 115,200 baud.
TEST_F(StreamPair, AFloodIsReadAtTheRateOfASerialLine) {
    const std::string flood(4000, 'P');
    ASSERT_EQ(::write(client_.get(), flood.data(), flood.size()), 4000);
    EXPECT_EQ(stream_->events(), POLLIN);
    const auto begin = Stream::Clock::now();
    std::size_t bytes = 0;
    int pauses = 0;
    while (bytes < 240) {
        const std::size_t chunk = stream_->receive().size();
        bytes += chunk;
        if (chunk == 0) {
            ++pauses;
            EXPECT_FALSE(stream_->gone());
            EXPECT_TRUE(!stream_->pauses() || stream_->events() == 0);
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    }
    const double rate = static_cast<double>(bytes) / std::chrono::duration<double>(Stream::Clock::now() - begin).count();
    EXPECT_GT(pauses, 10);
    EXPECT_LT(rate, 13'000) << "bytes per second";
}

TEST_F(StreamPair, ClientThatDoesNotReadAnswersIsNotRead) {
    ASSERT_EQ(::write(client_.get(), "P", 1), 1);
    while (stream_->waiting() < 8000) {  // more than Stream::kMaxUnread
        ASSERT_TRUE(stream_->send(std::string(1000, 'x')));
    }
    EXPECT_EQ(stream_->events(), POLLOUT);
    EXPECT_TRUE(stream_->receive().empty());
    while (stream_->has_waiting()) {
        (void)read_all();
        stream_->flush();
    }
    EXPECT_EQ(stream_->receive().size(), 1U);
}

TEST(TcpAddress, ParsesTheTextOfAnOption) {
    EXPECT_EQ(parse_tcp_address("--x", "18944").host, "127.0.0.1");
    EXPECT_EQ(parse_tcp_address("--x", ":18944").host, "127.0.0.1");
    EXPECT_EQ(parse_tcp_address("--x", "*:1").host, "*");
    EXPECT_EQ(parse_tcp_address("--x", "[::1]:1").host, "::1");
    EXPECT_EQ(parse_tcp_address("--x", "tracker.local:99").port, "99");
    for (const char* text : {"", "x", "70000", "-1", "1.5", "localhost:", "12 "}) {
        EXPECT_THROW(parse_tcp_address("--x", text), InputError) << text;
    }
}

TEST(TcpAddress, FormatsItselfAsInAUrl) {
    EXPECT_EQ(parse_tcp_address("--x", "18944").text(18944), "127.0.0.1:18944");
    EXPECT_EQ(parse_tcp_address("--x", "[::1]:0").text(7), "[::1]:7");
    EXPECT_EQ(parse_tcp_address("--x", "tracker.local:99").text(99), "tracker.local:99");
    EXPECT_TRUE(parse_tcp_address("--x", "[::]:0").is_any());
    EXPECT_FALSE(parse_tcp_address("--x", "[::1]:0").is_any());
}

TEST(OwnName, IsANumericAddressOrTheGivenName) {
    const auto is_own = [](const char* host, const char* address, int port) {
        return web::is_own_name(host, parse_tcp_address("--web", address), port);
    };
    EXPECT_TRUE(is_own("localhost:8080", "8080", 8080));
    EXPECT_TRUE(is_own("[::1]:8080", "[::1]:8080", 8080));
    EXPECT_FALSE(is_own("localhost:8081", "8080", 8080));
    EXPECT_FALSE(is_own("localhost", "8080", 8080));
    EXPECT_TRUE(is_own("localhost", "80", 80));  // browsers omit the default port
    EXPECT_TRUE(is_own("localhost:80", "80", 80));
    EXPECT_FALSE(is_own("evil.example", "80", 80));
    EXPECT_TRUE(is_own("192.0.2.7:8080", "0.0.0.0:8080", 8080));
    EXPECT_TRUE(is_own("[fd00::5]:8080", "[::]:8080", 8080));
    EXPECT_TRUE(is_own("192.0.2.7:8080", "*:8080", 8080));
    EXPECT_FALSE(is_own("192.0.2.7:8080", "8080", 8080));
    EXPECT_FALSE(is_own("[fd00::5]:8080", "[fd00::6]:8080", 8080));
    EXPECT_TRUE(is_own("[fd00::5]:8080", "[fd00::5]:8080", 8080));
    EXPECT_TRUE(is_own("tracker.local:8080", "tracker.local:8080", 8080));
    EXPECT_FALSE(is_own("tracker.local:8080", "0.0.0.0:8080", 8080));
    EXPECT_FALSE(is_own("", "0.0.0.0:80", 80));
}

TEST(TcpListener, PortInUseIsReported) {
    const TcpListener first("--x", {"127.0.0.1", "0"});
    try {
        const TcpListener second("--x", {"127.0.0.1", std::to_string(first.port())});
        FAIL() << "the second listener opened a port in use";
    } catch (const DeviceError& error) {
        EXPECT_NE(std::string(error.what()).find("the port is used by another program"), std::string::npos);
    }
    EXPECT_THROW(TcpListener("--x", {"no.such.host.invalid", "0"}), InputError);
    EXPECT_THROW(TcpListener("--x", {"192.0.2.1", "0"}), InputError);  // not an address of this machine
}

TEST(TcpListener, ClientsThatNeitherAnswerNorReadAreDisconnected) {
    const TcpListener listener("--x", {"127.0.0.1", "0"});
    const int client = test::connect_to(static_cast<std::uint16_t>(listener.port()));
    const int accepted = listener.accept();
    ASSERT_GE(accepted, 0);
    const auto option = [accepted](int level, int name) {
        int value = -1;
        socklen_t size = sizeof value;
        EXPECT_EQ(::getsockopt(accepted, level, name, &value, &size), 0);
        return value;
    };
    EXPECT_EQ(option(SOL_SOCKET, SO_KEEPALIVE), 1);
    EXPECT_LE(option(IPPROTO_TCP, TCP_KEEPIDLE) + option(IPPROTO_TCP, TCP_KEEPINTVL), 30);
    EXPECT_EQ(option(IPPROTO_TCP, TCP_USER_TIMEOUT), 30'000);
    EXPECT_EQ(option(IPPROTO_TCP, TCP_NODELAY), 1);
    ::close(accepted);
    ::close(client);
}

}  // namespace
}  // namespace tricoil::host

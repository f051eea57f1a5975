// A line to a client that reads slowly, not at all, or is gone.
#include "board/host/serve/stream.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <array>
#include <csignal>
#include <optional>

#include "board/host/errors.hpp"
#include "board/host/serve/tcp_listener.hpp"

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
    EXPECT_LE(stream_->waiting(), Stream::kMostWaiting);
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

TEST_F(StreamPair, AClientThatIsGoneIsSeen) {
    std::array<char, 16> buffer{};
    EXPECT_TRUE(stream_->receive(buffer).empty());
    EXPECT_FALSE(stream_->gone());
    client_.reset();
    EXPECT_TRUE(stream_->receive(buffer).empty());
    EXPECT_TRUE(stream_->gone());
    EXPECT_FALSE(stream_->send("late"));
}

TEST(TcpAddress, AsPeopleWriteIt) {
    EXPECT_EQ(parse_tcp_address("--x", "18944").host, "127.0.0.1");
    EXPECT_EQ(parse_tcp_address("--x", ":18944").host, "127.0.0.1");
    EXPECT_EQ(parse_tcp_address("--x", "*:1").host, "*");
    EXPECT_EQ(parse_tcp_address("--x", "[::1]:1").host, "::1");
    EXPECT_EQ(parse_tcp_address("--x", "tracker.local:99").port, "99");
    for (const char* text : {"", "x", "70000", "-1", "1.5", "localhost:", "12 "}) {
        EXPECT_THROW(parse_tcp_address("--x", text), InputError) << text;
    }
}

TEST(TcpListener, APortInUseIsSaid) {
    const TcpListener first("--x", {"127.0.0.1", "0"});
    try {
        const TcpListener second("--x", {"127.0.0.1", std::to_string(first.port())});
        FAIL();
    } catch (const DeviceError& error) {
        EXPECT_NE(std::string(error.what()).find("another program has this port"), std::string::npos);
    }
    EXPECT_THROW(TcpListener("--x", {"no.such.host.invalid", "0"}), InputError);
    EXPECT_THROW(TcpListener("--x", {"192.0.2.1", "0"}), InputError);  // not ours
}

}  // namespace
}  // namespace tricoil::host

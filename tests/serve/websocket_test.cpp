// WebSocket output: handshake, frames, refused pages, and clients that do not read.
#include <gmock/gmock.h>

#include <chrono>
#include <thread>

#include "board/host/serve/websocket/session.hpp"
#include "board/support/errors.hpp"
#include "tests/cli/cli_runner.hpp"
#include "tests/serve/serving.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr unsigned kText = 1;
constexpr unsigned kClose = 8;
constexpr unsigned kPong = 10;

std::string upgrade(const std::string& further_fields = {}, const std::string& key = "dGhlIHNhbXBsZSBub25jZQ==") {
    return "GET /chat HTTP/1.1\r\nHost: server.example.com\r\nUpgrade: WebSocket\r\nConnection: keep-alive, Upgrade\r\n"
           "Sec-WebSocket-Key: " +
           key + "\r\nSec-WebSocket-Version: 13\r\n" + further_fields + "\r\n";
}

struct Frame {
    unsigned opcode = 0;
    std::string content;
};

/// Client that checks the handshake and splits the stream into frames.
class WebSocketClient {
public:
    explicit WebSocketClient(const Serving& serving, const std::string& further_fields = {}, int receive_buffer = 0)
        : line_(connect_to(port_of(serving), receive_buffer)) {
        send(upgrade(further_fields));
        while (head_.find("\r\n\r\n") == std::string::npos) {
            const std::string more = read_for(line_, std::chrono::seconds(10), 1);
            if (more.empty()) {
                break;
            }
            head_ += more;
        }
        const auto end = std::min(head_.find("\r\n\r\n"), head_.size() - 4) + 4;
        bytes_ = head_.substr(end);
        head_.resize(end);
    }
    ~WebSocketClient() { close(line_); }
    WebSocketClient(const WebSocketClient&) = delete;
    WebSocketClient& operator=(const WebSocketClient&) = delete;

    static std::uint16_t port_of(const Serving& serving) {
        std::string address = serving.address("websocket");
        EXPECT_THAT(address, StartsWith("ws://127.0.0.1:"));
        EXPECT_EQ(address.back(), '/');
        return static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));
    }

    [[nodiscard]] const std::string& head() const { return head_; }
    void send(const std::string& bytes) { EXPECT_EQ(write(line_, bytes.data(), bytes.size()), std::ssize(bytes)); }
    /// As a client must: masked. The mask is zero.
    void send_frame(unsigned opcode, const std::string& content) {
        send(std::string{static_cast<char>(0x80U | opcode), static_cast<char>(0x80U | content.size()), 0, 0, 0, 0} + content);
    }

    /// The next frame; opcode 0 if the connection has ended.
    Frame next() {
        while (true) {
            const std::size_t begin = bytes_.size() > 1 && bytes_[1] == 126 ? 4 : 2;  // after the length in two bytes
            if (bytes_.size() >= begin) {
                const std::size_t size = begin == 2 ? byte(1) : std::size_t{byte(2)} << 8U | byte(3);
                EXPECT_LT(byte(1), 127U);  // not masked, not huge
                if (bytes_.size() >= begin + size) {
                    Frame frame{byte(0) & 0x0fU, bytes_.substr(begin, size)};
                    EXPECT_EQ(byte(0) & 0xf0U, 0x80U);  // complete, no extension
                    bytes_.erase(0, begin + size);
                    return frame;
                }
            }
            const std::string more = read_for(line_, std::chrono::seconds(10), 1);
            if (more.empty()) {
                return {};
            }
            bytes_ += more;
        }
    }

    /// The next frame that does not contain a pose.
    Frame next_answer() {
        constexpr int kMost = 5000;
        Frame frame = next();
        for (int n = 0; n < kMost && frame.opcode == kText; ++n) {
            frame = next();
        }
        return frame;
    }

private:
    [[nodiscard]] unsigned byte(std::size_t n) const { return static_cast<unsigned char>(bytes_[n]); }

    int line_;
    std::string head_;
    std::string bytes_;
};

host::websocket::HandshakeAnswer answer_to(const std::string& request, const std::vector<std::string>& origins) {
    return host::websocket::answer_handshake(host::web::read_head(request).value(), origins);
}

TEST(WebSocket, HandshakeOfTheStandard) {
    const auto answer = answer_to(upgrade(), {});
    EXPECT_TRUE(answer.accepted);
    EXPECT_THAT(answer.text, StartsWith("HTTP/1.1 101 "));
    EXPECT_THAT(answer.text, HasSubstr("\r\nSec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo=\r\n"));  // RFC 6455, 1.3
}

TEST(WebSocket, RefusesOtherRequestsAndOtherPages) {
    const std::vector<std::pair<std::string, std::string>> requests{
        {"GET / HTTP/1.1\r\nHost: a\r\n\r\n", "HTTP/1.1 426 "},
        {"HEAD / HTTP/1.1\r\n\r\n", "HTTP/1.1 426 "},
        {"nonsense\r\n\r\n", "HTTP/1.1 400 "},
        {upgrade({}, "short"), "HTTP/1.1 400 "},
        {upgrade({}, "dGhlIHNhbXBsZSBub25jZ!=="), "HTTP/1.1 400 "},
        {upgrade("Upgrade: websocket\r\n"), "HTTP/1.1 400 "},
        {upgrade("Origin: http://evil.example\r\n"), "HTTP/1.1 403 "},
        {upgrade("Origin: null\r\n"), "HTTP/1.1 403 "},
        {upgrade("Origin: http://localhost:30000\r\n"), "HTTP/1.1 403 "},
    };
    for (const auto& [request, status] : requests) {
        const auto answer = answer_to(request, {"http://localhost:3000"});
        EXPECT_FALSE(answer.accepted) << request;
        EXPECT_THAT(answer.text, StartsWith(status)) << request;
    }
    std::string old = upgrade();
    old.replace(old.find("13"), 2, "8");
    EXPECT_THAT(answer_to(old, {}).text, HasSubstr("\r\nSec-WebSocket-Version: 13\r\n"));
    EXPECT_TRUE(answer_to(upgrade("Origin: http://localhost:3000\r\n"), {"http://localhost:3000"}).accepted);
}

TEST(WebSocket, OriginsAreWrittenAsBrowsersSendThem) {
    for (const char* origin : {"null", "http://localhost:3000", "https://example.org", "http://[::1]:80"}) {
        EXPECT_NO_THROW(host::websocket::check_origin(origin));
    }
    for (const char* origin : {"", "*", "localhost:3000", "http://", "http://localhost/", "http://a b"}) {
        EXPECT_THROW(host::websocket::check_origin(origin), host::InputError) << origin;
    }
}

TEST(WebSocket, AClientReceivesEveryPose) {
    const Serving serving({"--websocket", "0", "--scenario", "still"});
    WebSocketClient client(serving);
    ASSERT_THAT(client.head(), StartsWith("HTTP/1.1 101 "));
    int last = -1;
    for (int n = 0; n < 500; ++n) {
        const Frame frame = client.next();
        ASSERT_EQ(frame.opcode, kText);
        const auto pose = nlohmann::json::parse(frame.content);
        EXPECT_EQ(frame.content.back(), '}');
        if (pose["flag_names"].get<std::string>().find("stale") != std::string::npos) {
            continue;  // sent if the machine pauses for half a second
        }
        EXPECT_TRUE(last < 0 || pose["sequence"].get<int>() == last + 1);
        last = pose["sequence"].get<int>();
        EXPECT_TRUE(pose.contains("utc_s") && pose.contains("q_wxyz"));
    }
}

TEST(WebSocket, PingsAndClosesAreAnsweredAndMessagesIgnored) {
    const Serving serving({"--websocket", "0", "--scenario", "still"});
    WebSocketClient client(serving);
    client.send_frame(kText, "{\"record\": true}");
    client.send_frame(9, "are you there");
    const Frame pong = client.next_answer();
    EXPECT_EQ(pong.opcode, kPong);
    EXPECT_EQ(pong.content, "are you there");
    client.send_frame(kClose, "\x03\xe8");
    const Frame closed = client.next_answer();
    EXPECT_EQ(closed.opcode, kClose);
    EXPECT_EQ(closed.content, "\x03\xe8");
    EXPECT_EQ(client.next().opcode, 0U);
}

TEST(WebSocket, AViolationOfTheProtocolEndsTheConnection) {
    const Serving serving({"--websocket", "0", "--scenario", "still"});
    for (const std::string& bytes : {std::string("\x81\x02hi", 4), std::string("\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff", 10),
                                     std::string("\x82\xff\x7f\xff\xff\xff\xff\xff\xff\xff\x01\x02\x03\x04too long", 22)}) {
        WebSocketClient client(serving);
        client.send(bytes);
        const Frame closed = client.next_answer();
        EXPECT_EQ(closed.opcode, kClose);
        EXPECT_EQ(client.next().opcode, 0U);
    }
    WebSocketClient(serving, "X: " + std::string(20'000, 'x') + "\r\n");  // a head without an end is not read to the end
    WebSocketClient client(serving);
    EXPECT_EQ(client.next().opcode, kText);
}

TEST(WebSocket, APageOfAnotherOriginIsTurnedAway) {
    const Serving serving({"--websocket", "0", "--scenario", "still", "--allow-origin", "http://localhost:3000"});
    WebSocketClient stranger(serving, "Origin: http://evil.example\r\n");
    EXPECT_THAT(stranger.head(), StartsWith("HTTP/1.1 403 "));
    WebSocketClient friendly(serving, "Origin: http://localhost:3000\r\n");
    EXPECT_EQ(friendly.next().opcode, kText);
}

TEST(WebSocket, AClientThatDoesNotReadLosesWholeMessagesAndDelaysNobody) {
    Serving serving({"--websocket", "0", "--scenario", "still"});
    {
        WebSocketClient stalled(serving, {}, 2048);
        WebSocketClient reader(serving);
        int last = -1;
        const auto end = Clock::now() + std::chrono::seconds(8);  // more than the buffers of the socket hold
        while (Clock::now() < end) {
            const int sequence = nlohmann::json::parse(reader.next().content)["sequence"].get<int>();
            EXPECT_TRUE(last < 0 || sequence == last + 1 || sequence == last);  // equal: the stale pose of a paused machine
            last = sequence;
        }
        const auto next_of_stalled = [&] {
            const Frame frame = stalled.next();
            EXPECT_EQ(frame.opcode, kText);
            return nlohmann::json::parse(frame.content)["sequence"].get<int>();
        };
        int previous = next_of_stalled();
        int gap = 0;
        for (int n = 0; n < 10'000 && gap < 2; ++n) {  // what waited for it, then poses after the gap
            const int sequence = next_of_stalled();
            gap = sequence - previous;
            previous = sequence;
        }
        EXPECT_GT(gap, 1);
    }
    EXPECT_EQ(serving.stop(SIGTERM), 0);
    EXPECT_THAT(serving.err(),
                ::testing::ContainsRegex("--websocket: [0-9]+ records were dropped, because clients read too slowly"));
}

TEST(WebSocket, RefusesWrongOptions) {
    const Serving first({"--websocket", "0", "--scenario", "still"});
    const std::string port = std::to_string(WebSocketClient::port_of(first));
    const std::vector<std::tuple<std::string, std::string, int>> lines{
        {"--websocket 99999", "--websocket 99999: needs a port number up to 65535", 2},
        {"--websocket here", "--websocket here: needs a port number", 2},
        {"--websocket 192.0.2.1:9000", "--websocket 192.0.2.1:9000: cannot listen", 2},
        {"--websocket " + port, "the port is used by another program", 3},
        {"--websocket 0 --allow-origin localhost:3000", "--allow-origin localhost:3000: must be an origin", 2},
        {"--json-lines tcp:0 --allow-origin null", "--allow-origin: only with --websocket", 2},
    };
    for (const auto& [options, reason, code] : lines) {
        const auto result = tricoil("serve " + options);
        EXPECT_EQ(result.exit_code, code) << options;
        EXPECT_THAT(result.err, HasSubstr(reason)) << options;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }
}

}  // namespace
}  // namespace tricoil::test

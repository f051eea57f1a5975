// Head of an HTTP request, and answers.
#include "board/host/serve/web/request_head.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace tricoil::host::web {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;
using ::testing::StartsWith;

RequestHead head_of(std::string_view received) { return read_head(received).value(); }

TEST(RequestHead, HoldsOnlyTheFieldsThatTheServerNeeds) {
    const RequestHead head = head_of(
        "GET / HTTP/1.1\r\nHost: localhost:80\r\nRange: bytes=0-99999999\r\nAccept-Encoding: gzip\r\nExpect: 100-continue\r\n"
        "REMOTE_ADDR: 127.0.0.1\r\nX-Forwarded-For: ,\r\nContent-Length: 7\r\nAUTHORIZATION:  Bearer x \r\n\r\n");
    EXPECT_EQ(head.refusal, 0) << head.reason;
    EXPECT_EQ(head.method + head.path, "GET/");
    EXPECT_THAT(head.fields,
                ElementsAre(Pair("authorization", "Bearer x"), Pair("content-length", "7"), Pair("host", "localhost:80")));
    EXPECT_EQ(head.content, 0U);  // of a GET: it has no effect
    EXPECT_TRUE(head.takes_chunks);
    EXPECT_FALSE(head.is_upgrade);
}

TEST(RequestHead, APostHasContent) {
    const RequestHead head = head_of("POST /control HTTP/1.0\r\nContent-Type: application/json\r\nContent-Length: 7\r\n\r\n");
    EXPECT_EQ(head.content, 7U);
    EXPECT_EQ(head.field("content-type"), "application/json");
    EXPECT_FALSE(head.takes_chunks);
}

TEST(RequestHead, ThePathIsDecodedAndHasNoQuery) {
    const auto path_of = [](const std::string& target) { return head_of("GET " + target + " HTTP/1.1\r\n\r\n").path; };
    EXPECT_EQ(path_of("/%73tream?x=/y"), "/stream");
    EXPECT_EQ(path_of("/%C3%a4"), "/\xc3\xa4");
    for (const char* target : {"/%", "/%4", "/%4g", "/%%", "/%-1", "/%+1", "/%0x41", "/% "}) {
        EXPECT_NE(path_of(target), "/A") << target;
    }
    EXPECT_EQ(path_of("/%4%41%4"), "/%4A%4");
}

TEST(RequestHead, AnUpgradeNeedsBothOfItsFields) {
    const auto is_upgrade = [](const std::string& line, const std::string& fields) {
        return head_of(line + "\r\n" + fields + "\r\n").is_upgrade;
    };
    const std::string both = "Upgrade: x, WebSocket\r\nConnection: keep-alive, Upgrade\r\n";
    EXPECT_TRUE(is_upgrade("GET / HTTP/1.1", both));
    EXPECT_FALSE(is_upgrade("HEAD / HTTP/1.1", both));
    EXPECT_FALSE(is_upgrade("GET / HTTP/1.0", both));
    EXPECT_FALSE(is_upgrade("GET / HTTP/1.1", "Upgrade: websocket\r\n"));
    EXPECT_FALSE(is_upgrade("GET / HTTP/1.1", "Upgrade: websockets\r\nConnection: Upgrade\r\n"));
    EXPECT_FALSE(is_upgrade("GET / HTTP/1.1", "Upgrade: websocket\r\nConnection: keep-alive\r\n"));
}

TEST(RequestHead, MalformedRequestsAreRefused) {
    const std::vector<std::pair<std::string, int>> requests{
        {"\r\n\r\n", 400},
        {"GET /\r\n\r\n", 400},
        {"GET  HTTP/1.1\r\n\r\n", 400},
        {"GET http://x/ HTTP/1.1\r\n\r\n", 400},
        {"GET / x HTTP/1.1\r\n\r\n", 400},
        {"GET /\n HTTP/1.1\r\n\r\n", 400},
        {"GET /\x7f HTTP/1.1\r\n\r\n", 400},
        {"GET /\xc3\xa4 HTTP/1.1\r\n\r\n", 400},
        {"GET / HTTP/2\r\n\r\n", 400},
        {"GET / HTTP/2.0\r\n\r\n", 400},
        {"PUT / HTTP/1.1\r\n\r\n", 405},
        {"get / HTTP/1.1\r\n\r\n", 405},
        {"GET /" + std::string(256, 'x') + " HTTP/1.1\r\n\r\n", 414},
        {"GET / HTTP/1.1\r\nno colon\r\n\r\n", 400},
        {"GET / HTTP/1.1\r\nHost: a\r\n folded\r\n\r\n", 400},
        {"GET / HTTP/1.1\r\nOther: a\r\n\tfolded\r\n\r\n", 400},
        {"GET / HTTP/1.1\r\nHost : a\r\n\r\n", 400},
        {"GET / HTTP/1.1\r\nHost: a\nX: b\r\n\r\n", 400},
        {"GET / HTTP/1.1\r\nHost: a\rX: b\r\n\r\n", 400},
        {"GET / HTTP/1.1\r\nHost: \xc3\xa4\r\n\r\n", 400},
        {"GET / HTTP/1.1\r\nHost: a\r\nhost: b\r\n\r\n", 400},
        {"GET / HTTP/1.1\r\nHost:\r\nhost: a\r\n\r\n", 400},
        {"GET / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n", 501},
        {"POST / HTTP/1.1\r\n\r\n", 411},
        {"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n", 501},
        {"POST / HTTP/1.1\r\nTransfer-Encoding: gzip\r\nContent-Length: 7\r\n\r\n", 501},
        {"POST / HTTP/1.1\r\nContent-Length: 7\r\nTransfer-Encoding: chunked\r\n\r\n", 400},
        {"POST / HTTP/1.1\r\nContent-Length:\r\n\r\n", 400},
        {"POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n", 400},
        {"POST / HTTP/1.1\r\nContent-Length: 0x1\r\n\r\n", 400},
        {"POST / HTTP/1.1\r\nContent-Length: 7\r\nContent-Length: 7\r\n\r\n", 400},
        {"POST / HTTP/1.1\r\nContent-Length: 7, 7\r\n\r\n", 400},
        {"POST / HTTP/1.1\r\nContent-Length: 1025\r\n\r\n", 413},
        {"POST / HTTP/1.1\r\nContent-Length: 99999999999999999999\r\n\r\n", 400},
        {"GET / HTTP/1.1\r\nOther: " + std::string(kLongestHead, 'x'), 431},
        {std::string(kLongestHead, 'G'), 431},
    };
    for (const auto& [text, status] : requests) {
        const RequestHead head = head_of(text);
        EXPECT_EQ(head.refusal, status) << text;
        EXPECT_THAT(head.reason, ::testing::Not(::testing::IsEmpty())) << text;
        EXPECT_THAT(answer(head.refusal, head.reason), StartsWith("HTTP/1.1 " + std::to_string(status) + ' ')) << text;
    }
}

TEST(RequestHead, AnyBytesGiveARefusalOrAWellFormedHead) {
    std::mt19937 random(7);
    const std::string valid = "POST /control HTTP/1.1\r\nHost: localhost\r\nContent-Length: 7\r\nRange: bytes=1-2\r\n\r\n";
    int accepted = 0;
    for (int n = 0; n < 20'000; ++n) {
        std::string text = valid;
        for (unsigned change = 0; change < random() % 4; ++change) {
            text[random() % text.size()] = static_cast<char>(random());
        }
        const auto head = read_head(text);
        if (!head) {
            continue;
        }
        accepted += head->refusal == 0 ? 1 : 0;
        EXPECT_EQ(head->refusal == 0, head->path.starts_with('/') && head->reason.empty());
        EXPECT_LE(head->content, kLongestContent);
        EXPECT_EQ(head->fields.count("range"), 0U);
    }
    EXPECT_GT(accepted, 5000);
    EXPECT_LT(accepted, 19'000);
}

TEST(RequestHead, EndsWithAnEmptyLine) {
    const std::string head = "POST / HTTP/1.1\r\nContent-Length: 6\r\n\r\n";
    for (std::size_t size = 0; size < head.size(); ++size) {
        EXPECT_FALSE(read_head(head.substr(0, size)).has_value()) << size;
    }
    EXPECT_EQ(head_of(head).size, head.size());
    EXPECT_EQ(head_of(head + " \r\n\r\n more").size, head.size());
}

TEST(HttpAnswer, IsCompleteAndOneObject) {
    EXPECT_THAT(
        answer(404, "no \"such\"\r\npage"),
        ::testing::AllOf(StartsWith("HTTP/1.1 404 Not Found\r\nConnection: close\r\n"), HasSubstr("\r\nContent-Length: 32\r\n"),
                         ::testing::EndsWith("\r\n\r\n{\"answer\":\"no \\\"such\\\"\\r\\npage\"}")));
    EXPECT_EQ(as_piece("0123456789abcdef", true), "10\r\n0123456789abcdef\r\n");
    EXPECT_EQ(as_piece("0123", false) + last_piece(false), "0123");
}

}  // namespace
}  // namespace tricoil::host::web

// Reduced head of an HTTP request, as the HTTP library receives it.
#include "board/host/serve/web/request_head.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace tricoil::host::web {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(RequestHead, HoldsOnlyTheFieldsThatThePageNeeds) {
    const RequestHead head = reduced_head(
        "GET / HTTP/1.1\r\nHost: localhost:80\r\nRange: bytes=0-99999999\r\nAccept-Encoding: gzip\r\nExpect: 100-continue\r\n"
        "REMOTE_ADDR: 127.0.0.1\r\nX-Forwarded-For: ,\r\nContent-Length: 7\r\nAUTHORIZATION:  Bearer x \r\n\r\n");
    EXPECT_EQ(head.refusal, 0) << head.reason;
    EXPECT_EQ(head.text, "GET / HTTP/1.1\r\nhost: localhost:80\r\nauthorization: Bearer x\r\n\r\n");
}

TEST(RequestHead, APostKeepsItsBodysTypeAndLength) {
    const RequestHead head =
        reduced_head("POST /control HTTP/1.1\r\nContent-Type: application/json\r\nContent-Length: 7\r\n\r\n");
    EXPECT_EQ(head.text, "POST /control HTTP/1.1\r\ncontent-type: application/json\r\ncontent-length: 7\r\n\r\n");
}

TEST(RequestHead, AFormIsNotPassedOnAsOne) {
    const RequestHead head =
        reduced_head("POST / HTTP/1.1\r\nContent-Type: multipart/form-data; boundary=x\r\nContent-Length: 7\r\n\r\n");
    EXPECT_EQ(head.text, "POST / HTTP/1.1\r\ncontent-length: 7\r\n\r\n");
}

TEST(RequestHead, MalformedRequestsAreRefused) {
    const std::vector<std::pair<std::string, int>> requests{
        {"\r\n\r\n", 400},
        {"GET /\r\n\r\n", 400},
        {"GET  HTTP/1.1\r\n\r\n", 400},
        {"GET http://x/ HTTP/1.1\r\n\r\n", 400},
        {"GET / x HTTP/1.1\r\n\r\n", 400},
        {"GET /\n HTTP/1.1\r\n\r\n", 400},
        {"GET / HTTP/2\r\n\r\n", 505},
        {"PUT / HTTP/1.1\r\n\r\n", 405},
        {"GET /" + std::string(256, 'x') + " HTTP/1.1\r\n\r\n", 414},
        {"GET / HTTP/1.1\r\nno colon\r\n\r\n", 400},
        {"GET / HTTP/1.1\r\nHost: a\r\n folded\r\n\r\n", 400},
        {"GET / HTTP/1.1\r\nHost : a\r\n\r\n", 400},
        {"GET / HTTP/1.1\r\nHost: a\nX: b\r\n\r\n", 400},
        {"GET / HTTP/1.1\r\nHost: a\r\nhost: b\r\n\r\n", 400},
        {"POST / HTTP/1.1\r\n\r\n", 411},
        {"POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n", 501},
        {"POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n", 400},
        {"POST / HTTP/1.1\r\nContent-Length: 99999999999999999999\r\n\r\n", 400},
    };
    for (const auto& [text, status] : requests) {
        const RequestHead head = reduced_head(text);
        EXPECT_EQ(head.refusal, status) << text;
        EXPECT_THAT(refusal_answer(head), HasSubstr("HTTP/1.1 " + std::to_string(status))) << text;
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
        const RequestHead head = reduced_head(text);
        accepted += head.refusal == 0 ? 1 : 0;
        EXPECT_EQ(head.refusal == 0, head.text.ends_with("\r\n\r\n") && head.reason.empty());
        EXPECT_THAT(head.text, Not(HasSubstr("ange")));
    }
    EXPECT_GT(accepted, 5000);
    EXPECT_LT(accepted, 19'000);
}

}  // namespace
}  // namespace tricoil::host::web

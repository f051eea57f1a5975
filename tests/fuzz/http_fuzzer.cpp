// Random bytes as an HTTP request: it is refused, or its head has known fields and limited lengths and is read again as the same.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <string>
#include <string_view>

#include "board/host/serve/web/request_head.hpp"

namespace {

using namespace tricoil::host::web;  // NOLINT(google-build-using-namespace): a program of one file

void require(bool holds) {
    if (!holds) {
        std::abort();
    }
}

void check_accepted(const RequestHead& head) {
    constexpr std::array<std::string_view, 9> kNames{
        "host",           "origin",  "authorization",     "sec-fetch-site",       "content-type",
        "content-length", "upgrade", "sec-websocket-key", "sec-websocket-version"};
    require(head.reason.empty() && (head.method == "GET" || head.method == "HEAD" || head.method == "POST"));
    require(head.path.starts_with('/') && head.path.size() <= 256);
    require(head.content <= kLongestContent && (head.content == 0 || head.method == "POST"));
    std::string text = head.method + " / HTTP/1." + (head.takes_chunks ? "1" : "0") + "\r\n";
    for (const auto& [name, value] : head.fields) {
        require(std::find(kNames.begin(), kNames.end(), name) != kNames.end());
        require(!value.empty() && std::all_of(value.begin(), value.end(), [](char c) { return c >= ' ' && c <= '~'; }));
        text += name + ": " + value + "\r\n";
    }
    const RequestHead again = read_head(text + "\r\n").value();
    require(again.refusal == 0 && again.method == head.method && again.fields == head.fields && again.content == head.content);
}

void check(const RequestHead& head) {
    if (head.refusal == 0) {
        check_accepted(head);
    } else {
        require(head.refusal >= 400 && head.refusal < 600 && !head.reason.empty());
        require(answer(head.refusal, head.reason).starts_with("HTTP/1.1 "));
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    const std::string_view received(reinterpret_cast<const char*>(data), size);      // NOLINT: bytes as text
    const auto head = read_head(received);
    require(head || received.size() < kLongestHead);
    if (head) {
        check(*head);
        require(head->size <= received.size() && (head->refusal != 0 || received.substr(0, head->size).ends_with("\r\n\r\n")));
    }
    return 0;
}

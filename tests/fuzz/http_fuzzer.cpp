// Random bytes as an HTTP request: the head for the server library has a limited length, one end, and only known fields.
#include <array>
#include <cstdlib>
#include <string_view>

#include "board/host/serve/web/request_head.hpp"

namespace {

void require(bool holds) {
    if (!holds) {
        std::abort();
    }
}

void check_passed_on(std::string_view text, std::size_t received) {
    require(text.ends_with("\r\n\r\n") && text.find("\r\n\r\n") == text.size() - 4);
    constexpr std::array<std::string_view, 6> kNames{
        "host: ", "origin: ", "authorization: ", "sec-fetch-site: ", "content-type: ", "content-length: "};
    require(text.size() <= received + 4 + kNames.size());  // a missing end, and a space after each colon
    text.remove_prefix(text.find("\r\n") + 2);
    while (text != "\r\n") {
        bool known = false;
        for (const std::string_view name : kNames) {
            known = known || text.starts_with(name);
        }
        require(known);
        text.remove_prefix(text.find("\r\n") + 2);
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    using namespace tricoil::host::web;
    const std::string_view received(reinterpret_cast<const char*>(data), size);  // NOLINT: bytes as text
    const RequestHead head = reduced_head(received);
    if (head.refusal == 0) {
        check_passed_on(head.text, received.size());
        require(reduced_head(head.text).text == head.text);
    } else {
        require(head.refusal >= 400 && head.refusal < 600 && !head.reason.empty());
        require(refusal_answer(head).starts_with("HTTP/1.1 "));
    }
    return 0;
}

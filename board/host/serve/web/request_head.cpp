#include "board/host/serve/web/request_head.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/status.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <charconv>
#include <utility>

#include "board/support/json_text.hpp"

namespace tricoil::host::web {
namespace {

namespace http = boost::beast::http;

constexpr std::size_t kLongestTarget = 256;
constexpr const char* kKnownFields[] = {"host",          "origin",  "authorization",     "sec-fetch-site",
                                        "content-type",  "upgrade", "sec-websocket-key", "sec-websocket-version",
                                        "content-length"};

RequestHead refuse(int status, std::string reason) {
    RequestHead head;
    head.refusal = status;
    head.reason = std::move(reason);
    return head;
}

template <typename Text>
std::string text_of(const Text& text) {
    return {text.data(), text.size()};
}

bool is_printable(std::string_view text) {
    return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

/// True if a field continues on the next line, which RFC 9112, 5.2 permits to refuse.
bool is_folded(std::string_view head) {
    return head.find("\r\n ") != std::string_view::npos || head.find("\r\n\t") != std::string_view::npos;
}

/// Decodes %XX. Text that is not a valid code stays.
std::string decoded(std::string_view path) {
    std::string text;
    while (!path.empty()) {
        unsigned char code = 0;
        const std::string_view digits = path.substr(1, 2);
        const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), code, 16);
        const bool is_code = path[0] == '%' && error == std::errc{} && end == path.data() + 3;
        text += is_code ? static_cast<char>(code) : path[0];
        path.remove_prefix(is_code ? 3 : 1);
    }
    return text;
}

}  // namespace

std::string RequestHead::field(const std::string& name) const {
    const auto at = fields.find(name);
    return at == fields.end() ? "" : at->second;
}

bool RequestHead::is_from_other_page() const {
    const std::string site = field("sec-fetch-site");
    return !site.empty() && site != "same-origin" && site != "none";  // none: the user entered the address
}

std::optional<RequestHead> read_head(std::string_view received) {
    http::request_parser<http::empty_body> parser;
    parser.header_limit(kLongestHead);
    parser.body_limit(kLongestContent);
    boost::system::error_code failure;
    const std::size_t size = parser.put(boost::asio::buffer(received), failure);
    if (failure == http::error::need_more) {
        return std::nullopt;
    }
    if (failure == http::error::header_limit) {
        return refuse(431, fmt::format("the head is longer than {} bytes", kLongestHead));
    }
    if (failure == http::error::body_limit) {
        return refuse(413, fmt::format("the content is longer than {} bytes", kLongestContent));
    }
    if (failure) {
        return refuse(400, fmt::format("the request is malformed ({})", failure.message()));
    }
    if (is_folded(received.substr(0, size))) {
        return refuse(400, "a header field is folded");
    }
    const auto& request = parser.get();
    RequestHead head;
    head.size = size;
    head.method = text_of(request.method_string());
    if (head.method != "GET" && head.method != "HEAD" && head.method != "POST") {
        return refuse(405, "only GET, HEAD and POST are supported");
    }
    const std::string target = text_of(request.target());
    if (target.size() > kLongestTarget) {
        return refuse(414, "the path is too long");
    }
    if (!target.starts_with('/') || !is_printable(target)) {
        return refuse(400, "the path is malformed");
    }
    if (request.count(http::field::transfer_encoding) > 0) {
        return refuse(501, "transfer encodings are not supported");
    }
    for (const char* name : kKnownFields) {
        const std::string value = text_of(request[name]);
        if (request.count(name) > 1) {
            return refuse(400, fmt::format("{} is given twice", name));
        }
        if (!is_printable(value)) {
            return refuse(400, fmt::format("{} contains a character that is not printable ASCII", name));
        }
        if (!value.empty()) {
            head.fields[name] = value;
        }
    }
    if (head.field("content-length").find(',') != std::string::npos) {
        return refuse(400, "content-length is given twice");
    }
    if (head.method == "POST" && !parser.content_length()) {
        return refuse(411, "Content-Length is missing");
    }
    head.path = decoded(target.substr(0, target.find('?')));
    head.takes_chunks = request.version() > 10;
    head.is_upgrade = boost::beast::websocket::is_upgrade(request);
    head.content = head.method == "POST" ? *parser.content_length() : 0;
    return head;
}

std::string answer_head(int status, std::string_view further_fields) {
    const auto reason = http::obsolete_reason(static_cast<http::status>(status));
    return fmt::format("HTTP/1.1 {} {}\r\nConnection: close\r\n{}\r\n", status, text_of(reason), further_fields);
}

std::string whole_answer(int status, std::string_view type, std::string_view content, std::string_view further_fields) {
    return answer_head(status, fmt::format("Content-Type: {}\r\nContent-Length: {}\r\n{}", type, content.size(), further_fields))
        .append(content);
}

std::string answer(int status, std::string_view text, std::string_view further_fields) {
    return whole_answer(status, "application/json", json_line({{"answer", text}}), further_fields);
}

std::string head_of_pieces(std::string_view type, bool takes_chunks) {
    return answer_head(200, fmt::format("Content-Type: {}\r\nCache-Control: no-store\r\n{}", type,
                                        takes_chunks ? "Transfer-Encoding: chunked\r\n" : ""));
}

std::string as_piece(std::string_view content, bool takes_chunks) {
    return takes_chunks ? fmt::format("{:x}\r\n{}\r\n", content.size(), content) : std::string(content);
}

std::string last_piece(bool takes_chunks) { return takes_chunks ? "0\r\n\r\n" : ""; }

}  // namespace tricoil::host::web

// Recognizes HTTP clients of ports for other protocols.
#pragma once

#include <algorithm>
#include <array>
#include <string_view>

namespace tricoil::host {

constexpr std::size_t kLongestHttpMethod = 8;  // with the space behind it

/// True if the first bytes of a client begin an HTTP request: a method and a space, at most kLongestHttpMethod bytes.
inline bool begins_http_request(std::string_view opening) {
    constexpr std::array<std::string_view, 9> kMethods{"GET ",   "HEAD ",    "POST ",    "PUT ",  "DELETE ",
                                                       "PATCH ", "OPTIONS ", "CONNECT ", "TRACE "};
    return std::any_of(kMethods.begin(), kMethods.end(), [&](std::string_view method) { return opening.starts_with(method); });
}

constexpr std::string_view kHttpRefusal =
    "HTTP/1.1 400 Refused\r\nContent-Type: text/plain\r\nConnection: close\r\n\r\nThis port does not serve HTTP.\n";

}  // namespace tricoil::host

// Reduces the head of an HTTP request to the fields that the live page needs, before the library parses it.
#pragma once

#include <string>
#include <string_view>

namespace tricoil::host::web {

/// Request line and header fields, or the reason for a refusal.
struct RequestHead {
    int refusal = 0;     // HTTP status; 0: accepted
    std::string reason;  // of a refusal, one line
    std::string text;    // for the library, with the empty line at its end
};

/// `received` ends with the empty line. Only GET, HEAD and POST requests for a path of at most 256 visible ASCII characters are
/// accepted; a POST needs a Content-Length. The result contains only the fields Host, Origin, Authorization and, for POST,
/// Content-Length and a Content-Type of application/json, each at most once. Other fields, for example Range, Accept-Encoding or
/// Expect, never reach the library (RFC 9110, 14.2: a server may ignore Range). A Transfer-Encoding or a folded line is refused,
/// and so is one of the listed fields that is repeated or contains other characters than printable ASCII.
RequestHead reduced_head(std::string_view received);

/// Complete HTTP answer for a refused request.
std::string refusal_answer(const RequestHead& head);

}  // namespace tricoil::host::web

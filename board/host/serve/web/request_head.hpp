// The head of an HTTP request, reduced to what the live page needs before the library parses it.
#pragma once

#include <string>
#include <string_view>

namespace tricoil::host::web {

/// A request line and header fields, or the reason for a refusal.
struct RequestHead {
    int refusal = 0;     // HTTP status; 0: accepted
    std::string reason;  // of a refusal, one line
    std::string text;    // for the library, with the empty line at its end
};

/// `received` ends with the empty line. The result holds only GET, HEAD and POST requests for a plain path, and of the header
/// fields only Host, Origin, Authorization and, for POST, Content-Length and a Content-Type of application/json, each at most
/// once. All others are left out: a Range, an Accept-Encoding or an Expect never reaches the library (RFC 9110, 14.2: a server
/// may ignore Range). A Transfer-Encoding, a folded line, a control character and a repeated field are refused.
RequestHead reduced_head(std::string_view received);

/// A complete answer for a refused request.
std::string refusal_answer(const RequestHead& head);

}  // namespace tricoil::host::web

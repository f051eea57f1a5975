// Reduces the head of an HTTP request to the fields that a server needs, before anything else parses it.
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>

namespace tricoil::host::web {

struct HeadField {
    std::string_view name;  // in lower case
    bool for_post_only = false;
};

/// Fields of the live page.
inline constexpr std::array kPageFields{HeadField{"host"},
                                        HeadField{"origin"},
                                        HeadField{"authorization"},
                                        HeadField{"sec-fetch-site"},
                                        HeadField{"content-type", true},
                                        HeadField{"content-length", true}};

/// Request line and header fields, or the reason for a refusal.
struct RequestHead {
    int refusal = 0;     // HTTP status; 0: accepted
    std::string reason;  // of a refusal, one line
    std::string text;    // for the library, with the empty line at its end
};

/// `received` ends with the empty line. Only GET, HEAD and POST requests for a path of at most 256 visible ASCII characters are
/// accepted; a POST needs a Content-Length. The result contains only the fields of `fields`, by default Host, Origin,
/// Authorization, Sec-Fetch-Site and, for POST, Content-Length and a Content-Type of application/json, each at most once and with
/// its name in lower case. Other fields, for example Range, Accept-Encoding or Expect, never reach the library (RFC 9110, 14.2: a
/// server may ignore Range). A Transfer-Encoding or a folded line is refused, and so is one of the listed fields that is repeated
/// or contains other characters than printable ASCII.
RequestHead reduced_head(std::string_view received, std::span<const HeadField> fields = kPageFields);

/// Value of a field in the text of a reduced head; empty: the field is missing. name: in lower case.
std::string_view value_of(std::string_view reduced, std::string_view name);

/// True if a browser sends this Sec-Fetch-Site for a request that another page makes. Other programs do not send it.
bool is_from_other_page(std::string_view fetch_site);

/// Complete HTTP answer for a refused request. further_fields: complete lines, for its header.
std::string refusal_answer(const RequestHead& head, std::string_view further_fields = {});

}  // namespace tricoil::host::web

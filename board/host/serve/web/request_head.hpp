// Head of an HTTP request, and answers.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace tricoil::host::web {

constexpr std::size_t kLongestHead = 16 * 1024;  // bytes
constexpr std::size_t kLongestContent = 1024;

/// Request line and known header fields, or the reason for a refusal.
struct RequestHead {
    int refusal = 0;     // HTTP status; 0: accepted
    std::string reason;  // of a refusal, one line
    std::size_t size = 0;
    std::string method;  // GET, HEAD or POST
    std::string path;    // decoded, without a query
    bool takes_chunks = false;
    bool is_upgrade = false;                    // to WebSocket
    std::size_t content = 0;                    // of a POST, in bytes
    std::map<std::string, std::string> fields;  // names in lower case

    /// Value of a field; empty: it is missing.
    [[nodiscard]] std::string field(const std::string& name) const;
    /// True if a browser marks the request as one of another page. Other programs do not send the field.
    [[nodiscard]] bool is_from_other_page() const;
};

/// Head at the beginning of `received`; nullopt: it is incomplete. Boost.Beast parses it. Besides its rules: only GET, HEAD and
/// POST requests for a path of at most 256 characters are accepted, and a POST needs a Content-Length of at most kLongestContent.
/// A Transfer-Encoding or a folded line is refused, and so is a known field that is repeated or contains other characters than
/// printable ASCII. Other fields, for example Range, have no effect (RFC 9110, 14.2: a server may ignore Range).
std::optional<RequestHead> read_head(std::string_view received);

/// Head of an answer, after which the connection ends. further_fields: complete lines.
std::string answer_head(int status, std::string_view further_fields);
/// Complete answer with this content.
std::string whole_answer(int status, std::string_view type, std::string_view content, std::string_view further_fields = {});
/// Complete answer {"answer": text}.
std::string answer(int status, std::string_view text, std::string_view further_fields = {});

/// Head of an answer that follows in pieces. takes_chunks: of the request.
std::string head_of_pieces(std::string_view type, bool takes_chunks);
std::string as_piece(std::string_view content, bool takes_chunks);
std::string last_piece(bool takes_chunks);

}  // namespace tricoil::host::web

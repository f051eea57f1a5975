// Opening handshake of WebSocket (RFC 6455, 4.2).
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tricoil::host::websocket {

struct HandshakeAnswer {
    bool accepted = false;
    std::string text;  // for the client
};

/// head: request with the empty line at its end. Browsers always send the origin of the page. It must be one of `origins`,
/// because any page that the user visits could connect otherwise. Requests of other programs have no origin.
HandshakeAnswer answer_handshake(std::string_view head, const std::vector<std::string>& origins);

/// Throws InputError, naming --allow-origin, if the text is not an origin as browsers send it: "null" or scheme://host[:port].
void check_origin(const std::string& origin);

}  // namespace tricoil::host::websocket

// Opening handshake of WebSocket (RFC 6455, 4.2).
#pragma once

#include <string>
#include <vector>

#include "board/host/serve/web/request_head.hpp"

namespace tricoil::host::websocket {

struct HandshakeAnswer {
    bool accepted = false;
    std::string text;  // for the client
};

/// Browsers always send the origin of the page. It must be one of `origins`, because any page that the user visits could connect
/// otherwise. Requests of other programs have no origin.
HandshakeAnswer answer_handshake(const web::RequestHead& request, const std::vector<std::string>& origins);

/// Throws InputError, naming --allow-origin, if the text is not an origin as browsers send it: "null" or scheme://host[:port].
void check_origin(const std::string& origin);

}  // namespace tricoil::host::websocket

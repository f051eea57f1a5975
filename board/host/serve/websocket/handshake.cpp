#include "board/host/serve/websocket/handshake.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/sha.h>

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

#include "board/support/errors.hpp"

namespace tricoil::host::websocket {
namespace {

HandshakeAnswer refuse_handshake(int status, std::string_view reason, std::string_view further_fields = {}) {
    return {false, web::answer(status, reason, further_fields)};
}

std::string base64(std::span<const unsigned char> bytes) {
    std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');                                      // the library adds a zero
    const int size = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()), bytes.data(),  // NOLINT: bytes as text
                                     static_cast<int>(bytes.size()));
    text.resize(static_cast<std::size_t>(size));
    return text;
}

/// 16 random bytes of the client in base64.
bool is_key(std::string_view key) {
    constexpr std::size_t kSize = 24;
    std::array<unsigned char, kSize> bytes{};
    return key.size() == kSize && key.ends_with("==") &&
           EVP_DecodeBlock(bytes.data(), reinterpret_cast<const unsigned char*>(key.data()), kSize) > 0;  // NOLINT
}

std::string accepted_key(std::string_view key) {
    const std::string text = std::string(key) + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11";  // RFC 6455, 1.3
    std::array<unsigned char, SHA_DIGEST_LENGTH> digest{};
    SHA1(reinterpret_cast<const unsigned char*>(text.data()), text.size(), digest.data());  // NOLINT
    return base64(digest);
}

}  // namespace

HandshakeAnswer answer_handshake(const web::RequestHead& request, const std::vector<std::string>& origins) {
    if (request.refusal != 0) {
        return refuse_handshake(request.refusal, request.reason);
    }
    if (!request.is_upgrade) {
        return refuse_handshake(426, "this port serves WebSocket clients only",
                                "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n");
    }
    if (request.field("sec-websocket-version") != "13") {
        return refuse_handshake(426, "the version of the protocol must be 13", "Sec-WebSocket-Version: 13\r\n");
    }
    const std::string key = request.field("sec-websocket-key");
    if (!is_key(key)) {
        return refuse_handshake(400, "Sec-WebSocket-Key is missing or malformed");
    }
    const std::string origin = request.field("origin");
    if (origin.empty() && request.is_from_other_page()) {
        return refuse_handshake(403, "request of a page without its origin");
    }
    if (!origin.empty() && std::find(origins.begin(), origins.end(), origin) == origins.end()) {
        return refuse_handshake(
            403, fmt::format("pages of {} may not connect; to permit them, use --allow-origin {}", origin, origin));
    }
    return {true, fmt::format("HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                              "Sec-WebSocket-Accept: {}\r\n\r\n",
                              accepted_key(key))};
}

void check_origin(const std::string& origin) {
    const auto scheme_end = origin.find("://");
    const bool has_host = scheme_end != std::string::npos && scheme_end > 0 && scheme_end + 3 < origin.size();
    const std::string_view host = has_host ? std::string_view(origin).substr(scheme_end + 3) : std::string_view();
    const bool is_plain = std::all_of(origin.begin(), origin.end(), [](char c) { return c > ' ' && c <= '~'; });
    if (origin != "null" && (!has_host || !is_plain || host.find('/') != std::string_view::npos)) {
        throw InputError(
            fmt::format("--allow-origin {}: must be an origin as in http://localhost:3000, without a path, or null", origin));
    }
}

}  // namespace tricoil::host::websocket

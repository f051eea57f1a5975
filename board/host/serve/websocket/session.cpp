#include "board/host/serve/websocket/session.hpp"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <openssl/sha.h>

#include <algorithm>
#include <array>
#include <new>
#include <span>
#include <string_view>
#include <utility>

#include "board/pose_text/served_pose.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host::websocket {
namespace {

HandshakeAnswer refuse_handshake(int status, std::string_view reason, std::string_view further_fields = {}) {
    return {false, web::answer(status, reason, further_fields), std::string(reason)};
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
    return {true,
            fmt::format("HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                        "Sec-WebSocket-Accept: {}\r\n\r\n",
                        accepted_key(key)),
            ""};
}

void check_origin(const std::string& origin) {
    const auto scheme_end = origin.find("://");
    const bool has_host = scheme_end != std::string::npos && scheme_end > 0 && scheme_end + 3 < origin.size();
    const std::string_view host = has_host ? std::string_view(origin).substr(scheme_end + 3) : std::string_view();
    const bool is_plain = std::all_of(origin.begin(), origin.end(), [](char c) { return c > ' ' && c <= '~'; });
    refuse_if(origin != "null" && (!has_host || !is_plain || host.find('/') != std::string_view::npos),
              "--allow-origin {}: must be an origin as in http://localhost:3000, without a path, or null", origin);
}

Session::Session(Stream& stream, const std::vector<std::string>& origins, PoseUnits units)
    : stream_(stream), origins_(origins), units_(std::move(units)) {}

void Session::receive(std::span<const char> bytes) {
    received_.append(bytes.data(), bytes.size());
    if (!protocol_) {
        open();
    }
    if (protocol_) {
        const bool works = wslay_event_recv(protocol_.get()) == 0;
        send_frames();
        if (!works) {
            stream_.disconnect();
        }
    }
}

void Session::open() {
    const auto head = web::read_head(received_);
    if (!head) {
        return;
    }
    const HandshakeAnswer answer = answer_handshake(*head, origins_);
    received_.erase(0, head->size);
    stream_.send(answer.text);
    if (!answer.accepted) {
        stream_.refuse(answer.reason);
        return;
    }
    wslay_event_callbacks callbacks{};
    callbacks.recv_callback = [](wslay_event_context* context, std::uint8_t* to, std::size_t room, int, void* user) -> ssize_t {
        std::string& from = static_cast<Session*>(user)->received_;
        const std::size_t n = from.copy(reinterpret_cast<char*>(to), room);  // NOLINT: bytes as text
        from.erase(0, n);
        if (n == 0) {
            wslay_event_set_error(context, WSLAY_ERR_WOULDBLOCK);
            return -1;
        }
        return static_cast<ssize_t>(n);
    };
    callbacks.send_callback = [](wslay_event_context*, const std::uint8_t* from, std::size_t length, int, void* user) -> ssize_t {
        static_cast<Session*>(user)->frames_.append(reinterpret_cast<const char*>(from), length);  // NOLINT
        return static_cast<ssize_t>(length);
    };
    wslay_event_context* context = nullptr;
    if (wslay_event_context_server_init(&context, &callbacks, this) != 0) {
        throw std::bad_alloc();
    }
    protocol_.reset(context);
    wslay_event_config_set_no_buffering(context, 1);
    wslay_event_config_set_max_recv_msg_length(context, kLongestFrame);
}

void Session::send_frames() {
    const bool works = wslay_event_send(protocol_.get()) == 0;
    if (!frames_.empty()) {
        stream_.send(std::exchange(frames_, {}));
    }
    if (!works || wslay_event_get_close_sent(protocol_.get()) != 0) {
        stream_.disconnect();
    }
}

void Session::take(std::span<const ServedPose> poses) {
    if (!protocol_ && std::chrono::steady_clock::now() - came_ > kHandshakeLimit) {
        stream_.disconnect();
    }
    for (const ServedPose& served : poses) {
        if (!protocol_ || stream_.gone()) {
            return;
        }
        const std::string line = served_pose_line(served, units_);
        const std::string_view object = std::string_view(line).substr(0, line.size() - 1);  // without line feed
        const wslay_event_msg message{WSLAY_TEXT_FRAME, reinterpret_cast<const std::uint8_t*>(object.data()),  // NOLINT
                                      object.size()};
        if (wslay_event_queue_msg(protocol_.get(), &message) != 0) {
            stream_.disconnect();
            return;
        }
        send_frames();
    }
}

}  // namespace tricoil::host::websocket

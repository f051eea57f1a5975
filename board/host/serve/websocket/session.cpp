#include "board/host/serve/websocket/session.hpp"

#include <new>
#include <string_view>
#include <utility>

#include "board/host/serve/web/request_head.hpp"
#include "board/host/serve/websocket/handshake.hpp"
#include "board/pose_text/served_pose.hpp"

namespace tricoil::host::websocket {
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
        stream_.disconnect();
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

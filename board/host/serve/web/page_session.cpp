#include "board/host/serve/web/page_session.hpp"

#include <fmt/format.h>
#include <sys/socket.h>

#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "board/host/serve/web/control_request.hpp"
#include "board/host/serve/web/own_name.hpp"
#include "board/host/serve/web/page_text.hpp"
#include "board/host/serve/web/recording_library.hpp"

namespace tricoil::host::web {
namespace {

constexpr std::string_view kRecordings = "/recordings";
constexpr std::string_view kRecording = "/recordings/";

constexpr std::string_view kPageFields =
    "Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; "
    "img-src data:; frame-ancestors 'none'\r\n"
    "Referrer-Policy: no-referrer\r\nX-Content-Type-Options: nosniff\r\nCache-Control: no-store\r\n";

/// Refusal of a request without permission. what: requested action.
std::string refuse_permission(const Access& access, std::string_view what) {
    if (access.controls == Controls::none) {
        return answer(403, "this server is read only");
    }
    return answer(401,
                  fmt::format("for {}, open the link with the token (printed by tricoil serve, or in its --token-file)", what));
}

}  // namespace

void PageSession::receive(std::span<const char> bytes) {
    if (answered_) {
        return;
    }
    received_.append(bytes.data(), bytes.size());
    const auto head = read_head(received_);
    if (!head || received_.size() < head->size + head->content) {
        return;
    }
    answered_ = true;
    takes_chunks_ = head->takes_chunks;
    wants_head_ = head->method == "HEAD";
    std::string text;
    try {
        text = answer_to(*head, received_.substr(head->size, head->content));
    } catch (const std::exception&) {
        text = answer(500, "internal error");
    }
    send(std::move(text));
}

/// text: complete answer, or a piece of it; empty: none yet.
void PageSession::send(std::string text) {
    if (text.empty()) {
        return;
    }
    if (wants_head_) {
        text.resize(text.find("\r\n\r\n") + 4);
        events_.reset();
        playback_.reset();
    }
    stream_.send(text);
}

void PageSession::take(std::span<const ServedPose> /*poses*/) {
    if (!answered_ || ended_) {
        if (std::chrono::steady_clock::now() - since_ > kRequestLimit) {
            stream_.disconnect();
        }
        return;
    }
    if (stream_.has_waiting()) {
        return;
    }
    if (auto piece = next_piece()) {
        send(std::move(*piece));
    } else {
        // Until the client disconnects, what it still sends is read: otherwise the system would discard what it has not yet read.
        ended_ = true;
        since_ = std::chrono::steady_clock::now();
        ::shutdown(stream_.descriptor(), SHUT_WR);
    }
}

/// Next piece of the answer; empty: not now; nullopt: the answer is complete.
std::optional<std::string> PageSession::next_piece() {
    if (playback_) {
        return playback_->next();
    }
    if (!events_) {
        return std::nullopt;
    }
    const std::string event = events_->next();
    return event.empty() ? event : as_piece(event, takes_chunks_);
}

bool PageSession::is_ours(const RequestHead& head) const {
    const std::string host = head.field("host");
    const std::string origin = head.field("origin");
    const bool may_be_linked = head.path == "/";  // a link on another page may lead to the live page
    return is_own_name(host, page_.address, page_.port, page_.access.names) && (may_be_linked || !head.is_from_other_page()) &&
           (origin.empty() || origin == "http://" + host);
}

std::string PageSession::answer_to(const RequestHead& head, const std::string& content) {
    if (head.refusal != 0) {
        return answer(head.refusal, head.reason);
    }
    if (!is_ours(head)) {
        return answer(403, "request from another page, or to an unknown host name; to permit a name, use --allow-host NAME");
    }
    const bool is_permitted = page_.access.permits(head.field("authorization"));
    if (head.method == "POST") {
        if (head.path != "/control") {
            return answer(404, "there is no such page");
        }
        return is_permitted ? control(head, content) : refuse_permission(page_.access, "controls");
    }
    const bool is_list = head.path == kRecordings;
    if (!is_list && !head.path.starts_with(kRecording)) {
        return page_or_stream(head);
    }
    if (!is_permitted) {
        return refuse_permission(page_.access, "recordings");
    }
    const std::string& folder = page_.recordings.folder();
    if (!is_list) {
        playback_ = std::make_unique<Playback>(folder, head.path.substr(kRecording.size()), takes_chunks_);
        return {};
    }
    const nlohmann::json list{{"recordings", RecordingLibrary(folder).list()}};
    return whole_answer(200, "application/json", list.dump());
}

std::string PageSession::page_or_stream(const RequestHead& head) {
    if (head.path == "/") {
        return whole_answer(200, "text/html", kPage, kPageFields);
    }
    if (head.path != "/stream") {
        return answer(404, "there is no such page");
    }
    auto place = page_.streams.enter(stream_.descriptor());
    if (!place) {
        return answer(503, "too many pages are open");
    }
    stream_.hold(std::move(place));
    events_.emplace(page_);
    return head_of_pieces("text/event-stream", takes_chunks_);
}

std::string PageSession::control(const RequestHead& head, const std::string& content) {
    // Pages of other origins need permission (CORS) to send this type.
    if (head.field("content-type") != "application/json") {
        return answer(415, "the request must be JSON (Content-Type: application/json)");
    }
    const std::string done = execute_request(content, page_.control, page_.recordings, page_.button);
    return done.empty() ? answer(400, "unknown request") : answer(200, done);
}

}  // namespace tricoil::host::web

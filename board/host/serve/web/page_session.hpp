// Session of one client of the live page: one request and its answer.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "board/host/serve/stream.hpp"
#include "board/host/serve/web/event_stream.hpp"
#include "board/host/serve/web/playback.hpp"
#include "board/host/serve/web/request_head.hpp"
#include "board/host/serve/web/served_page.hpp"

namespace tricoil::host::web {

/// GET /: the page. GET /stream: its events. POST /control: a control request, GET /recordings and /recordings/NAME: recordings,
/// if the access rules permit it. A request that does not name this host and port, or comes from another page, is refused (403),
/// so that a hostile page in the same browser has no access.
class PageSession {
public:
    static constexpr bool kSpeaksHttp = true;
    static constexpr std::chrono::seconds kRequestLimit{5};  // for a complete request, and for the end of an answered client

    PageSession(Stream& stream, ServedPage& page) : stream_(stream), page_(page) {}

    void receive(std::span<const char> bytes);
    void take(std::span<const ServedPose> poses);
    /// The next piece of the answer does not wait for a pose.
    [[nodiscard]] bool is_busy() const { return answered_ && !ended_ && !events_ && !stream_.has_waiting(); }

private:
    void send(std::string text);
    /// Complete answer, or its beginning; empty if a playback gives it.
    std::string answer_to(const RequestHead& head, const std::string& content);
    std::string page_or_stream(const RequestHead& head);
    std::string control(const RequestHead& head, const std::string& content);
    [[nodiscard]] bool is_ours(const RequestHead& head) const;
    std::optional<std::string> next_piece();

    Stream& stream_;
    ServedPage& page_;
    std::chrono::steady_clock::time_point since_ = std::chrono::steady_clock::now();  // of the connection, or of the answer's end
    std::string received_;
    bool answered_ = false;
    bool ended_ = false;  // the answer
    bool takes_chunks_ = false;
    bool wants_head_ = false;
    std::optional<EventStream> events_;
    std::unique_ptr<Playback> playback_;
};

}  // namespace tricoil::host::web

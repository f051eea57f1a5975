#include "board/host/serve/web/page_output.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <string_view>
#include <utility>

#include "board/host/serve/tcp_service.hpp"
#include "board/host/serve/web/page_text.hpp"
#include "board/host/serve/web/recording_library.hpp"
#include "board/host/serve/web/request_head.hpp"
#include "board/host/serve/web/setup_command.hpp"
#include "board/page/pose_event.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "core/tracking/hemisphere.hpp"

namespace tricoil::host::web {
namespace {

constexpr std::size_t kShare = 1024;                  // bytes per read: 1 MB/s
constexpr std::chrono::milliseconds kReplaceable{0};  // a client without a stream; the next one may replace it at once

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

constexpr std::chrono::milliseconds kPeriod{33};
constexpr std::chrono::milliseconds kIdlePeriod{500};

/// True for a numeric address as in a URL: 192.0.2.1 or [2001:db8::1].
bool is_ip_address(const std::string& name) {
    std::array<unsigned char, sizeof(in6_addr)> address{};
    const bool bracketed = name.size() > 2 && name.front() == '[' && name.back() == ']';
    return ::inet_pton(AF_INET, name.c_str(), address.data()) == 1 ||
           (bracketed && ::inet_pton(AF_INET6, name.substr(1, name.size() - 2).c_str(), address.data()) == 1);
}

/// What the clients of a live page share.
struct ServedPage {
    TcpAddress address;
    Access access;
    const PoseHub& hub;
    TrackerControl& control;
    RecordingSwitch& recordings;
    StylusButton& button;
    Tour* tour;
    int port = 0;
    ConnectionTable streams{"--web"};
    std::uint64_t last_page = 0;
    std::set<std::uint64_t> open_pages{};   // by number
    std::uint64_t setting_up = 0;           // number of the page that sets up the device; 0: none
    std::weak_ptr<SetupCommand> command{};  // of that page
};

/// Executes a control request in JSON. Returns, or throws as InputError, text for the client; empty: the request is invalid.
std::string execute_request(const std::string& text, ServedPage& page) {
    const nlohmann::json request = nlohmann::json::parse(text, nullptr, false);
    if (!request.is_object()) {
        return "";
    }
    if (request.contains("run") && request["run"].is_boolean()) {
        page.control.set_running(request["run"].get<bool>());
        return page.control.running() ? "running" : "stopped, coils off";
    }
    if (request.contains("record") && request["record"].is_boolean()) {
        const auto name = request.value("name", nlohmann::json(""));
        return name.is_string() ? page.recordings.record(request["record"].get<bool>(), name.get<std::string>()) : "";
    }
    if (request.contains("button") && request["button"].is_boolean()) {
        page.button.set(request["button"].get<bool>());
        return request["button"].get<bool>() ? "button pressed" : "button released";
    }
    if (request.contains("button") && request["button"] == "click") {
        page.button.click();
        return "button clicked";
    }
    if (page.tour != nullptr && request.contains("step") && request.contains("compensated") &&
        request["step"].is_number_unsigned() && request["step"] < page.recordings.source()["tour"].size() &&
        request["compensated"].is_boolean()) {
        const auto speed = request.value("speed", nlohmann::json(page.tour->now.load().speed));
        if (!speed.is_number() || !web::is_tour_speed(speed.get<double>())) {
            return "";
        }
        page.tour->asked = {request["step"].get<std::int16_t>(), request["compensated"].get<bool>(), speed.get<float>()};
        return "the tour goes on";
    }
    if (request.contains("hemisphere")) {
        Vec3<double> towards;
        const auto sensor = request.value("sensor", nlohmann::json(0U));
        if (!read_list(request["hemisphere"], towards) || !tracking::is_hemisphere(towards) || !sensor.is_number_unsigned() ||
            sensor.get<std::uint64_t>() >= tracking::kMaxSensors) {
            return "";
        }
        if (!page.control.hemisphere_refusal().empty()) {
            return page.control.hemisphere_refusal();
        }
        page.control.set_hemisphere(sensor.get<std::uint8_t>(), towards);
        return "hemisphere set";
    }
    return "";
}

/// Events for one live page. An event has all poses since the last one; a page that reads too slowly misses poses that the hub no
/// longer has.
class EventStream {
public:
    explicit EventStream(ServedPage& page) : page_(page), cursor_(page.hub.cursor()), hello_(greeting(page.recordings.source())) {
        hello_["page"] = number_;
        page_.open_pages.insert(number_);
    }
    /// Ends the set-up by this page.
    ~EventStream() {
        page_.open_pages.erase(number_);
        page_.setting_up = page_.setting_up == number_ ? 0 : page_.setting_up;
    }
    EventStream(const EventStream&) = delete;
    EventStream& operator=(const EventStream&) = delete;

    /// The next event; empty if none is due: at most every 33 ms, and after 0.5 s also without a pose.
    std::string next() {
        const auto now = Clock::now();
        if (now - last_ < kPeriod) {
            return {};
        }
        poses_.clear();
        page_.hub.read(cursor_, poses_);
        silence_.check(utc_now(), poses_);
        if (poses_.empty() && now - last_ < kIdlePeriod) {
            return {};
        }
        last_ = now;
        LinkHealth health = page_.hub.health();
        health.counts.dropped += cursor_.missed;  // by this page
        const std::string event =
            pose_event(poses_,
                       {page_.control.running(), page_.recordings.status(), to_text(page_.access.controls),
                        static_cast<int>(page_.streams.size()), utc_now(), health, page_.hub.confinement(),
                        page_.tour != nullptr ? page_.tour->now.load() : TourPlace{}, page_.hub.newer_levels(levels_seen_),
                        page_.tour != nullptr ? page_.tour->other_error_m.load() : 0},
                       hello_);
        hello_ = nullptr;
        return event;
    }

private:
    using Clock = std::chrono::steady_clock;

    ServedPage& page_;
    std::uint64_t number_ = ++page_.last_page;
    PoseHub::Cursor cursor_;
    nlohmann::ordered_json hello_;  // null after the first event
    std::vector<ServedPose> poses_;
    SilenceWatch silence_;
    std::uint64_t levels_seen_ = 0;
    Clock::time_point last_ = Clock::now();
};

/// Session of one client: one request and its answer. GET /: the page. GET /stream: its events. POST /control: a control request,
/// POST /setup: a step of the set-up, GET /recordings and /recordings/NAME: recordings, if the access rules permit it. A request
/// that does not name this host and port, or comes from another page, is refused (403), so that a hostile page in the same
/// browser has no access.
class PageSession {
public:
    static constexpr bool kSpeaksHttp = true;
    static constexpr std::chrono::seconds kRequestLimit{5};  // for a complete request, and for the end of an answered client

    PageSession(Stream& stream, ServedPage& page) : stream_(stream), page_(page) {}

    void receive(std::span<const char> bytes) {
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
        } catch (const InputError& refusal) {
            text = answer(422, refusal.what());
        } catch (const std::exception&) {
            text = answer(500, "internal error");
        }
        send(std::move(text));
    }

    void take(std::span<const ServedPose> /*poses*/) {
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
            // Until the client disconnects, what it still sends is read: otherwise the system would discard what it has not yet
            // read.
            ended_ = true;
            since_ = std::chrono::steady_clock::now();
            ::shutdown(stream_.descriptor(), SHUT_WR);
        }
    }

    /// The next piece of the answer does not wait for a pose.
    [[nodiscard]] bool is_busy() const { return answered_ && !ended_ && !events_ && !setup_ && !stream_.has_waiting(); }

private:
    /// text: complete answer, or a piece of it; empty: none yet.
    void send(std::string text) {
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

    /// Complete answer, or its beginning; empty if a playback gives it.
    std::string answer_to(const RequestHead& head, const std::string& content) {
        if (head.refusal != 0) {
            return answer(head.refusal, head.reason);
        }
        if (!is_ours(head)) {
            return answer(403, "request from another page, or to an unknown host name; to permit a name, use --allow-host NAME");
        }
        const bool is_permitted = page_.access.permits(head.field("authorization"));
        if (head.method == "POST") {
            if (head.path != "/control" && head.path != "/setup") {
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

    std::string page_or_stream(const RequestHead& head) {
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

    std::string control(const RequestHead& head, const std::string& content) {
        // Pages of other origins need permission (CORS) to send this type.
        if (head.field("content-type") != "application/json") {
            return answer(415, "the request must be JSON (Content-Type: application/json)");
        }
        if (head.path == "/setup") {
            return set_up(nlohmann::json::parse(content, nullptr, false));
        }
        const std::string done = execute_request(content, page_);
        return done.empty() ? answer(400, "unknown request") : answer(200, done);
    }

    /// Set-up by one page at a time: {"page": its number, "end": true}, or {"page", "run", ...} of SetupCommand; without "run" it
    /// begins.
    std::string set_up(const nlohmann::json& request) {
        if (!request.is_object() || !request.contains("page") || !request["page"].is_number_unsigned()) {
            return answer(400, "unknown request");
        }
        const auto number = request["page"].get<std::uint64_t>();
        const char* const refusal =
            !page_.open_pages.contains(number) ? "this page is not connected; wait until it is, and try again"
            : page_.setting_up != 0 && page_.setting_up != number
                ? "another page sets up this device; close the set-up there first"
            : request.contains("run") && page_.command.lock() ? "a command of the set-up is running; wait until it ends"
                                                              : nullptr;
        if (refusal != nullptr) {
            return answer(409, refusal);
        }
        page_.setting_up = request.contains("end") ? 0 : number;
        if (!request.contains("run")) {
            return answer(200, request.contains("end") ? "the set-up has ended" : "the set-up has begun");
        }
        setup_ = std::make_shared<SetupCommand>(request, page_.recordings.folder());
        page_.command = setup_;
        return {};
    }

    [[nodiscard]] bool is_ours(const RequestHead& head) const {
        const std::string host = head.field("host");
        const std::string origin = head.field("origin");
        const bool may_be_linked = head.path == "/";  // a link on another page may lead to the live page
        return is_own_name(host, page_.address, page_.port, page_.access.names) &&
               (may_be_linked || !head.is_from_other_page()) && (origin.empty() || origin == "http://" + host);
    }

    /// Next piece of the answer; empty: not now; nullopt: the answer is complete.
    std::optional<std::string> next_piece() {
        if (setup_) {
            const std::string result = setup_->result();
            setup_ = result.empty() ? setup_ : nullptr;
            return result.empty() ? result : whole_answer(200, "application/json", result);
        }
        if (playback_) {
            return playback_->next();
        }
        if (!events_) {
            return std::nullopt;
        }
        const std::string event = events_->next();
        return event.empty() ? event : as_piece(event, takes_chunks_);
    }

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
    std::shared_ptr<SetupCommand> setup_;
};

}  // namespace

bool is_own_name(const std::string& host, const TcpAddress& address, int port, const std::vector<std::string>& allowed) {
    constexpr int kUsualPort = 80;  // HTTP port, which browsers omit
    const std::string behind = fmt::format(":{}", port);
    std::string name = host;
    if (name.ends_with(behind)) {
        name.resize(name.size() - behind.size());
    } else if (port != kUsualPort) {
        return false;
    }
    return name == "localhost" || name == "127.0.0.1" || name == "[::1]" || name + behind == address.text(port) ||
           std::find(allowed.begin(), allowed.end(), name) != allowed.end() || (address.is_any() && is_ip_address(name));
}

Output make_output(const TcpAddress& address, Access access, const PoseHub& hub, TrackerControl& control,
                   RecordingSwitch& recordings, StylusButton& button, Tour* tour) {
    const std::shared_ptr<ServedPage> page(new ServedPage{address, std::move(access), hub, control, recordings, button, tour});
    auto service = std::make_unique<TcpService<PageSession>>(
        "--web", address, [page](Stream& stream) { return std::make_unique<PageSession>(stream, *page); },
        StreamLimits{std::chrono::hours(24), 0, kShare}, kReplaceable);
    page->port = service->port();
    const std::string url = "http://" + address.shown().text(page->port) + "/";
    const bool has_token = page->access.controls == Controls::by_token;
    return {std::move(service), url, has_token ? url + "#token=" + page->access.token : url};
}

}  // namespace tricoil::host::web

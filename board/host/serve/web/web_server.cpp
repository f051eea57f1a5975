#include "board/host/serve/web/web_server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "board/host/serve/silence_watch.hpp"
#include "board/host/serve/web/guarded_http_server.hpp"
#include "board/host/serve/web/own_name.hpp"
#include "board/host/serve/web/page_text.hpp"
#include "board/host/serve/web/pose_event.hpp"
#include "board/support/errors.hpp"
#include "board/support/wall_clock.hpp"

namespace tricoil::host::web {
namespace {

static_assert(WebServer::kMostStreams < GuardedHttpServer::kMostConnections);  // connections remain free for other requests
constexpr std::chrono::milliseconds kPeriod{33};                               // between events: as often as a page draws
constexpr std::chrono::milliseconds kPatience{500};                            // without poses: an event says that there are none
constexpr std::size_t kLongestWish = 1024;

void answer(httplib::Response& response, int status, const std::string& text) {
    response.status = status;
    response.set_content(nlohmann::json{{"answer", text}}.dump(), "application/json");
}

/// Event stream of one page: its position in the hub and the interval of its events.
struct Reader {
    const PoseHub& hub;
    const TrackerControl& control;
    RecordingSwitch& recordings;
    std::string controls;
    PoseHub::Cursor cursor;
    std::vector<ServedPose> poses;
    SilenceWatch silence;

    /// False after the client or the tracker is gone.
    bool send(httplib::DataSink& sink) {
        poses.clear();
        hub.wait(cursor, poses, kPatience);
        silence.look(utc_now_us(), poses);
        if (hub.closed()) {
            return false;
        }
        const RecordingStatus recording = recordings.status();
        const std::string event = pose_event(poses, {control.running(), recording.on, recording.trouble, controls});
        if (!sink.write(event.data(), event.size())) {
            return false;
        }
        std::this_thread::sleep_for(kPeriod);
        return true;
    }
};

/// Executes a control request. Returns the result as text for the client; empty if the request is invalid.
std::string carry_out(const nlohmann::json& wish, TrackerControl& control, RecordingSwitch& recordings) {
    if (wish.contains("run") && wish["run"].is_boolean()) {
        control.set_running(wish["run"].get<bool>());
        return control.running() ? "running" : "stopped, coils off";
    }
    if (wish.contains("record") && wish["record"].is_boolean()) {
        return recordings.record(wish["record"].get<bool>());
    }
    if (wish.contains("hemisphere") && wish["hemisphere"].is_array() && wish["hemisphere"].size() == 3) {
        Vec3<double> towards;
        for (std::size_t n = 0; n < 3; ++n) {
            const auto& number = wish["hemisphere"][n];
            towards[static_cast<Eigen::Index>(n)] =
                number.is_number() ? number.get<double>() : std::numeric_limits<double>::quiet_NaN();
        }
        const auto sensor = wish.value("sensor", nlohmann::json(0));
        if (!towards.allFinite() || !sensor.is_number_unsigned() || sensor.get<std::uint64_t>() >= tracking::kMaxSensors) {
            return "";
        }
        control.set_hemisphere(sensor.get<std::uint8_t>(), towards);
        return "hemisphere set";
    }
    return "";
}

}  // namespace

WebServer::WebServer(const TcpAddress& address, Access access, const PoseHub& hub, TrackerControl& control,
                     RecordingSwitch& recordings)
    : address_(address),
      access_(std::move(access)),
      hub_(hub),
      control_(control),
      recordings_(recordings),
      server_(std::make_unique<GuardedHttpServer>()) {
    port_ = TcpListener("--web", address).port();  // reports an invalid address with our message
    GuardedHttpServer& s = *server_;
    s.set_socket_options(
        [](socket_t socket) {  // old connections of an earlier server must not block the port, unlike with the library's default
            const int yes = 1;
            ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
        });
    s.set_payload_max_length(kLongestWish);
    s.set_exception_handler([](const httplib::Request&, httplib::Response& response, const std::exception_ptr&) {
        answer(response, 500, "internal error");  // the library would send what() to the client
    });
    s.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
        if (is_ours(request)) {
            return httplib::Server::HandlerResponse::Unhandled;
        }
        answer(response, 403, "asked by another page, or under a name that is not ours; for a name, use --allow-host NAME");
        return httplib::Server::HandlerResponse::Handled;
    });
    s.Get("/", [](const httplib::Request&, httplib::Response& response) {
        response.set_header("Content-Security-Policy",
                            "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; "
                            "img-src data:; frame-ancestors 'none'");
        response.set_header("Referrer-Policy", "no-referrer");
        response.set_header("X-Content-Type-Options", "nosniff");
        response.set_header("Cache-Control", "no-store");
        // Uses a content provider: the library would compress a text for every client, which takes seconds.
        response.set_content_provider(kPage.size(), "text/html", [](std::size_t at, std::size_t length, httplib::DataSink& sink) {
            const std::string_view piece = kPage.substr(std::min(at, kPage.size()), length);  // the library checks no bounds
            return sink.write(piece.data(), piece.size());
        });
    });
    s.Get("/stream", [this](const httplib::Request&, httplib::Response& response) { stream(response); });
    s.Post("/control",
           [this](const httplib::Request& request, httplib::Response& response) { this->control(request, response); });
    const std::string host = address.host == "*" ? "0.0.0.0" : address.host;
    if (!s.bind(host, port_)) {
        throw DeviceError(fmt::format("--web {}: cannot be listened to; choose another port", address.text(port_)));
    }
    thread_ = std::thread([this] { server_->listen_after_bind(); });
}

WebServer::~WebServer() {
    while (!server_->is_running()) {
        std::this_thread::yield();
    }
    server_->stop();
    thread_.join();
}

std::string WebServer::url() const {
    const TcpAddress shown = address_.is_any() ? TcpAddress{"localhost", ""} : address_;
    return "http://" + shown.text(port_) + "/";
}

std::string WebServer::control_url() const {
    return access_.controls == Controls::by_token ? url() + "#token=" + access_.token : url();
}

bool WebServer::is_ours(const httplib::Request& request) const {
    const std::string host = request.get_header_value("Host");
    return is_own_name(host, address_, port_, access_.names) &&
           (!request.has_header("Origin") || request.get_header_value("Origin") == "http://" + host);
}

void WebServer::stream(httplib::Response& response) {
    if (++streams_ > kMostStreams) {
        --streams_;
        answer(response, 503, fmt::format("limit of {} pages reached", kMostStreams));
        return;
    }
    server_->keep_this_connection();
    auto reader = std::make_shared<Reader>(Reader{hub_, control_, recordings_, to_text(access_.controls), hub_.cursor(), {}, {}});
    response.set_header("Cache-Control", "no-store");
    response.set_chunked_content_provider(
        "text/event-stream", [reader](std::size_t, httplib::DataSink& sink) { return reader->send(sink); },
        [this](bool) { --streams_; });
}

void WebServer::control(const httplib::Request& request, httplib::Response& response) {
    if (!access_.permits(request.get_header_value("Authorization"))) {
        const bool read_only = access_.controls == Controls::none;
        answer(response, read_only ? 403 : 401,
               read_only ? "this server is read only" : "controls need the link that tricoil serve gave at its start");
        return;
    }
    if (request.get_header_value("Content-Type") != "application/json") {  // another page cannot send JSON without permission
        answer(response, 415, "wishes are JSON");
        return;
    }
    const nlohmann::json wish = nlohmann::json::parse(request.body, nullptr, false);
    const std::string done = wish.is_object() ? carry_out(wish, control_, recordings_) : "";
    answer(response, done.empty() ? 400 : 200, done.empty() ? "no such wish" : done);
}

}  // namespace tricoil::host::web

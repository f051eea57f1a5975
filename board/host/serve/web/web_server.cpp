#include "board/host/serve/web/web_server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "board/host/serve/silence_watch.hpp"
#include "board/host/serve/web/guarded_http_server.hpp"
#include "board/host/serve/web/own_name.hpp"
#include "board/host/serve/web/page_text.hpp"
#include "board/host/serve/web/pose_event.hpp"
#include "board/host/serve/web/recording_library.hpp"
#include "board/host/serve/web/request_head.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host::web {
namespace {

static_assert(ConnectionTable::kMaxClients < GuardedHttpServer::kMaxConnections);  // leaves connections for other requests
constexpr std::chrono::milliseconds kPeriod{33};              // pause after an event; limits the rate at which a page gets poses
constexpr std::chrono::milliseconds kIdleEventInterval{500};  // longest wait for a pose before an event without poses
constexpr std::size_t kMaxRequestBytes = 1024;

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
    const ConnectionTable& pages;
    ConnectionTable::Place place;
    PoseHub::Cursor cursor;
    nlohmann::ordered_json hello;  // null after the first event
    std::vector<ServedPose> poses;
    SilenceWatch silence;

    /// False if the client has disconnected or the hub is closed.
    bool send(httplib::DataSink& sink) {
        poses.clear();
        hub.wait(cursor, poses, kIdleEventInterval);
        silence.check(utc_now(), poses);
        if (hub.closed()) {
            return false;
        }
        LinkHealth health = hub.health();
        health.counts.dropped += cursor.missed;  // by this page
        const std::string event = pose_event(poses,
                                             {control.running(), recordings.status(), controls, static_cast<int>(pages.size()),
                                              utc_now(), health, hub.confinement()},
                                             hello);
        hello = nullptr;
        if (!sink.write(event.data(), event.size())) {
            return false;
        }
        std::this_thread::sleep_for(kPeriod);
        return true;
    }
};

/// Executes a control request. Returns the result as text for the client; empty if the request is invalid.
std::string execute_request(const nlohmann::json& request, TrackerControl& control, RecordingSwitch& recordings,
                            StylusButton& button) {
    if (request.contains("run") && request["run"].is_boolean()) {
        control.set_running(request["run"].get<bool>());
        return control.running() ? "running" : "stopped, coils off";
    }
    if (request.contains("record") && request["record"].is_boolean()) {
        const auto name = request.value("name", nlohmann::json(""));
        return name.is_string() ? recordings.record(request["record"].get<bool>(), name.get<std::string>()) : "";
    }
    if (request.contains("button") && request["button"].is_boolean()) {
        button.set(request["button"].get<bool>());
        return request["button"].get<bool>() ? "button pressed" : "button released";
    }
    if (request.contains("button") && request["button"] == "click") {
        button.click();
        return "button clicked";
    }
    if (request.contains("hemisphere") && request["hemisphere"].is_array() && request["hemisphere"].size() == 3) {
        Vec3<double> towards;
        for (std::size_t n = 0; n < 3; ++n) {
            const auto& number = request["hemisphere"][n];
            towards[static_cast<Index>(n)] = number.is_number() ? number.get<double>() : std::numeric_limits<double>::quiet_NaN();
        }
        const auto sensor = request.value("sensor", nlohmann::json(0));
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
                     RecordingSwitch& recordings, StylusButton& button)
    : address_(address),
      access_(std::move(access)),
      hub_(hub),
      control_(control),
      recordings_(recordings),
      button_(button),
      server_(std::make_unique<GuardedHttpServer>()) {
    port_ = TcpListener("--web", address).port();  // reports an invalid address or a port in use like the other outputs
    GuardedHttpServer& s = *server_;
    // Not SO_REUSEPORT, the library's default: connections of an earlier server must not block the port.
    s.set_socket_options([](socket_t socket) {
        const int yes = 1;
        ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
        set_connection_options(socket);
    });
    s.set_payload_max_length(kMaxRequestBytes);
    s.set_exception_handler([](const httplib::Request&, httplib::Response& response, const std::exception_ptr&) {
        answer(response, 500, "internal error");  // by default the library sends what() in a header
    });
    s.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
        if (is_ours(request)) {
            return httplib::Server::HandlerResponse::Unhandled;
        }
        answer(response, 403, "request from another page, or to an unknown host name; to permit a name, use --allow-host NAME");
        return httplib::Server::HandlerResponse::Handled;
    });
    s.Get("/", [](const httplib::Request&, httplib::Response& response) {
        response.set_header("Content-Security-Policy",
                            "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; "
                            "img-src data:; frame-ancestors 'none'");
        response.set_header("Referrer-Policy", "no-referrer");
        response.set_header("X-Content-Type-Options", "nosniff");
        response.set_header("Cache-Control", "no-store");
        // A content provider sends the page without a copy of it.
        response.set_content_provider(kPage.size(), "text/html", [](std::size_t at, std::size_t length, httplib::DataSink& sink) {
            const std::string_view piece = part_of(kPage, at, length);
            return sink.write(piece.data(), piece.size());
        });
    });
    s.Get("/stream", [this](const httplib::Request&, httplib::Response& response) { stream(response); });
    s.Get("/recordings",
          [this](const httplib::Request& request, httplib::Response& response) { list_recordings(request, response); });
    s.Get("/recordings/(.+)",
          [this](const httplib::Request& request, httplib::Response& response) { send_recording(request, response); });
    s.Post("/control",
           [this](const httplib::Request& request, httplib::Response& response) { this->control(request, response); });
    const std::string host = address.host == "*" ? "0.0.0.0" : address.host;
    if (!s.bind(host, port_)) {
        throw DeviceError(fmt::format("--web {}: cannot listen; choose another port", address.text(port_)));
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
    const bool may_be_linked = request.path == "/";  // a link on another page may lead to the live page
    return is_own_name(host, address_, port_, access_.names) &&
           (may_be_linked || !is_from_other_page(request.get_header_value("Sec-Fetch-Site"))) &&
           (!request.has_header("Origin") || request.get_header_value("Origin") == "http://" + host);
}

void WebServer::stream(httplib::Response& response) {
    auto place = streams_.enter(server_->keep_this_connection());
    if (!place) {
        answer(response, 503, "too many pages are open");
        return;
    }
    auto reader = std::make_shared<Reader>(Reader{hub_,
                                                  control_,
                                                  recordings_,
                                                  to_text(access_.controls),
                                                  streams_,
                                                  std::move(place),
                                                  hub_.cursor(),
                                                  greeting(recordings_.source()),
                                                  {},
                                                  {}});
    response.set_header("Cache-Control", "no-store");
    response.set_chunked_content_provider("text/event-stream",
                                          [reader](std::size_t, httplib::DataSink& sink) { return reader->send(sink); });
}

bool WebServer::is_permitted(const httplib::Request& request, httplib::Response& response, const char* what) const {
    if (access_.permits(request.get_header_value("Authorization"))) {
        return true;
    }
    const bool read_only = access_.controls == Controls::none;
    answer(response, read_only ? 403 : 401,
           read_only
               ? "this server is read only"
               : fmt::format("for {}, open the link with the token (printed by tricoil serve, or in its --token-file)", what));
    return false;
}

void WebServer::list_recordings(const httplib::Request& request, httplib::Response& response) const {
    if (is_permitted(request, response, "recordings")) {
        response.set_content(nlohmann::json{{"recordings", RecordingLibrary(recordings_.folder()).list()}}.dump(),
                             "application/json");
    }
}

void WebServer::send_recording(const httplib::Request& request, httplib::Response& response) const {
    if (!is_permitted(request, response, "recordings")) {
        return;
    }
    const std::string name = request.matches[1];
    std::shared_ptr<const Recording> recording;
    try {
        recording = std::make_shared<const Recording>(RecordingLibrary(recordings_.folder()).open(name));
    } catch (const std::exception& error) {
        answer(response, 422, error.what());
        return;
    }
    response.set_header("Cache-Control", "no-store");
    response.set_chunked_content_provider("application/x-ndjson", [recording](std::size_t, httplib::DataSink& sink) {
        send_poses(*recording, [&](std::string_view piece) { return sink.write(piece.data(), piece.size()); });
        sink.done();
        return true;
    });
}

void WebServer::control(const httplib::Request& request, httplib::Response& response) {
    if (!is_permitted(request, response, "controls")) {
        return;
    }
    // Pages of other origins need permission (CORS) to send this type.
    if (request.get_header_value("Content-Type") != "application/json") {
        answer(response, 415, "the request must be JSON (Content-Type: application/json)");
        return;
    }
    const nlohmann::json command = nlohmann::json::parse(request.body, nullptr, false);
    const std::string done = command.is_object() ? execute_request(command, control_, recordings_, button_) : "";
    answer(response, done.empty() ? 400 : 200, done.empty() ? "unknown request" : done);
}

}  // namespace tricoil::host::web

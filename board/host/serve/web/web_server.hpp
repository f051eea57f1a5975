// Server of the live page: one embedded file, a stream of poses, and control requests.
#pragma once

#include <memory>
#include <string>
#include <thread>

#include "board/host/serve/access.hpp"
#include "board/host/serve/connection_table.hpp"
#include "board/host/serve/pose_hub.hpp"
#include "board/host/serve/recording_switch.hpp"
#include "board/host/serve/stylus_button.hpp"
#include "board/host/serve/tcp_listener.hpp"
#include "board/host/serve/tracker_control.hpp"

namespace httplib {
struct Request;
struct Response;
}  // namespace httplib

namespace tricoil::host::web {

class GuardedHttpServer;

/// GET /: the page. GET /stream: its events. POST /control: a control request, GET /recordings and /recordings/NAME: recordings,
/// if `access` permits it. A request that does not name this host and port, or comes from another page, is refused (403), so that
/// a hostile page in the same browser has no access.
class WebServer {
public:
    /// Starts to listen. The referenced objects must outlive this one. Throws InputError, naming --web, for an address
    /// that this machine does not have or a port that needs root, DeviceError for a port in use.
    WebServer(const TcpAddress& address, Access access, const PoseHub& hub, TrackerControl& control, RecordingSwitch& recordings,
              StylusButton& button);
    ~WebServer();
    WebServer(const WebServer&) = delete;
    WebServer& operator=(const WebServer&) = delete;

    [[nodiscard]] std::string url() const;
    /// URL with the token after the #, which browsers do not send to servers. Equal to url() without a token.
    [[nodiscard]] std::string control_url() const;

private:
    [[nodiscard]] bool is_ours(const httplib::Request& request) const;
    /// If the request lacks the permission, answers with the reason and returns false. what: requested action, for the reason.
    bool is_permitted(const httplib::Request& request, httplib::Response& response, const char* what) const;
    void stream(httplib::Response& response);
    void list_recordings(const httplib::Request& request, httplib::Response& response) const;
    void send_recording(const httplib::Request& request, httplib::Response& response) const;
    void control(const httplib::Request& request, httplib::Response& response);

    TcpAddress address_;
    Access access_;
    int port_ = 0;
    const PoseHub& hub_;
    TrackerControl& control_;
    RecordingSwitch& recordings_;
    StylusButton& button_;
    ConnectionTable streams_{"--web"};
    std::unique_ptr<GuardedHttpServer> server_;
    std::thread thread_;
};

}  // namespace tricoil::host::web

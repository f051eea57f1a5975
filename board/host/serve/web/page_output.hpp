// Output of `tricoil serve --web`: the live page.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "board/host/serve/access.hpp"
#include "board/host/serve/pose_hub.hpp"
#include "board/host/serve/recording_switch.hpp"
#include "board/host/serve/service.hpp"
#include "board/host/serve/stylus_button.hpp"
#include "board/host/serve/tracker_control.hpp"
#include "board/page/tour.hpp"
#include "board/support/tcp_listener.hpp"

namespace tricoil::host::web {

struct Output {
    std::unique_ptr<Service> service;
    std::string url;
    std::string control_url;  // with the token after the #, which browsers do not send to servers; without a token: url
};

/// tour: may be null. The referenced objects must outlive the service. Throws the errors of TcpListener, naming --web.
Output make_output(const TcpAddress& address, Access access, const PoseHub& hub, TrackerControl& control,
                   RecordingSwitch& recordings, StylusButton& button, Tour* tour = nullptr);

/// host: Host field of a request. Accepted are loopback names, the listening address or name, the allowed names and, if the
/// server listens on all addresses, any numeric address. Other names are refused, because a hostile page can use a name that
/// resolves to this machine (DNS rebinding).
bool is_own_name(const std::string& host, const TcpAddress& address, int port, const std::vector<std::string>& allowed = {});

}  // namespace tricoil::host::web

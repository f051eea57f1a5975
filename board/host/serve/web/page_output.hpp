// Output of `tricoil serve --web`: the live page.
#pragma once

#include <memory>
#include <string>

#include "board/host/serve/access.hpp"
#include "board/host/serve/pose_hub.hpp"
#include "board/host/serve/recording_switch.hpp"
#include "board/host/serve/service.hpp"
#include "board/host/serve/stylus_button.hpp"
#include "board/host/serve/tracker_control.hpp"
#include "board/support/tcp_listener.hpp"

namespace tricoil::host::web {

struct Output {
    std::unique_ptr<Service> service;
    std::string url;
    std::string control_url;  // with the token after the #, which browsers do not send to servers; without a token: url
};

/// The referenced objects must outlive the service. Throws the errors of TcpListener, naming --web.
Output make_output(const TcpAddress& address, Access access, const PoseHub& hub, TrackerControl& control,
                   RecordingSwitch& recordings, StylusButton& button);

}  // namespace tricoil::host::web

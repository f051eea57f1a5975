// What the clients of a live page share.
#pragma once

#include "board/host/serve/access.hpp"
#include "board/host/serve/connection_table.hpp"
#include "board/host/serve/pose_hub.hpp"
#include "board/host/serve/recording_switch.hpp"
#include "board/host/serve/stylus_button.hpp"
#include "board/host/serve/tracker_control.hpp"
#include "board/support/tcp_listener.hpp"

namespace tricoil::host::web {

struct ServedPage {
    TcpAddress address;
    Access access;
    const PoseHub& hub;
    TrackerControl& control;
    RecordingSwitch& recordings;
    StylusButton& button;
    int port = 0;
    ConnectionTable streams{"--web"};
};

}  // namespace tricoil::host::web

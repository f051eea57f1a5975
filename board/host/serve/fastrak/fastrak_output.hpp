// The places where a FASTRAK can be served.
#pragma once

#include <memory>
#include <string>

#include "board/host/serve/access.hpp"
#include "board/host/serve/pose_hub.hpp"
#include "board/host/serve/service.hpp"
#include "board/host/serve/tracker_control.hpp"

namespace tricoil::host::fastrak {

struct Output {
    std::unique_ptr<Service> service;
    std::string address;  // where clients find it
};

/// where: "pty" or "pty:LINK" (a pseudo terminal), "serial:PATH[:BAUD]" (115200 unless said), "tcp:[ADDRESS:]PORT". continuous:
/// sends from the start, as a FASTRAK does that was saved so. controls: a line of this machine may ask for a hemisphere unless
/// they are `none`, a TCP client only where they are `open`, as the protocol has no place for a token. hub and control must
/// outlive it. Throws InputError for another place, or one that cannot be used, DeviceError for a device or port that is not to
/// be had.
Output make_output(const std::string& where, bool continuous, Controls controls, const PoseHub& hub, TrackerControl& control);

}  // namespace tricoil::host::fastrak

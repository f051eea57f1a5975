// Creates a FASTRAK output on a pseudo terminal, serial port or TCP port.
#pragma once

#include <memory>
#include <string>

#include "board/host/serve/access.hpp"
#include "board/host/serve/pose_hub.hpp"
#include "board/host/serve/service.hpp"
#include "board/host/serve/stylus_button.hpp"
#include "board/host/serve/tracker_control.hpp"

namespace tricoil::host::fastrak {

struct Output {
    std::unique_ptr<Service> service;
    std::string address;  // address for clients
};

/// where: "pty" or "pty:LINK" (pseudo terminal), "serial:PATH[:BAUD]" (default 115200), "tcp:[ADDRESS:]PORT".
/// continuous: sends records from the start, like a FASTRAK with this setting saved.
/// controls: clients on a pseudo terminal or serial port may set a hemisphere unless it is `none`; TCP clients only if it is
/// `open`, because the protocol has no field for a token. For the same reason ^K of a TCP client saves for its own session only,
/// unless it is `open`. hub, control and button must outlive the service. Throws InputError for
/// an invalid `where`, DeviceError if the device or port cannot be opened.
Output make_output(const std::string& where, bool continuous, Controls controls, const PoseHub& hub, TrackerControl& control,
                   const StylusButton& button);

}  // namespace tricoil::host::fastrak

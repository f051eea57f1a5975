// Control requests of the live page.
#pragma once

#include <string>

#include "board/host/serve/recording_switch.hpp"
#include "board/host/serve/stylus_button.hpp"
#include "board/host/serve/tracker_control.hpp"

namespace tricoil::host::web {

/// Executes a request in JSON. Returns the result as text for the client; empty if the request is invalid.
std::string execute_request(const std::string& text, TrackerControl& control, RecordingSwitch& recordings, StylusButton& button);

}  // namespace tricoil::host::web

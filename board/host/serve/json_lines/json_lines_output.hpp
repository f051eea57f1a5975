// Output of `tricoil serve --json-lines`.
#pragma once

#include <memory>
#include <string>

#include "board/host/serve/service.hpp"
#include "board/pose_text/pose_fields.hpp"
#include "board/support/tcp_listener.hpp"

namespace tricoil::host::json_lines {

struct Output {
    std::unique_ptr<Service> service;
    TcpAddress address;
    std::string text;  // address for the user
};

/// where: tcp:[ADDRESS:]PORT or udp:[HOST:]PORT. Throws InputError for any other text, and
/// the errors of TcpListener and UdpService.
Output make_output(const std::string& where, const PoseUnits& units);

}  // namespace tricoil::host::json_lines

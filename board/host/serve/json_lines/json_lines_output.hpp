// Outputs of `tricoil serve --json-lines`: each pose as a line of JSON.
#pragma once

#include <memory>
#include <string>

#include "board/host/serve/service.hpp"
#include "board/linux/line_pump.hpp"
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

/// Sends each pose to standard output. A reader that is too slow misses whole lines. When the reader closes the pipe or the disk
/// is full, the program ends as on SIGTERM.
class StdoutSender final : public Service {
public:
    explicit StdoutSender(const PoseUnits& units);

    void take(std::span<const ServedPose> poses) override;

    /// Writes the remaining lines. Throws DeviceError if the disk is full or lines were dropped.
    void finish();

private:
    PoseUnits units_;
    linux_board::LinePump pump_;
    bool has_ended_ = false;
};

}  // namespace tricoil::host::json_lines

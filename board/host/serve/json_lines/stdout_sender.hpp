// Sends each pose as a line to standard output.
#pragma once

#include "board/host/serve/service.hpp"
#include "board/linux/line_pump.hpp"

namespace tricoil::host::json_lines {

/// A reader that is too slow misses whole lines. When the reader closes the pipe, the program ends as on SIGTERM.
class StdoutSender final : public Service {
public:
    StdoutSender();

    bool watch(std::vector<pollfd>& /*descriptors*/) override { return false; }
    void handle() override {}
    void take(std::span<const ServedPose> poses) override;

private:
    linux_board::LinePump pump_;
    bool has_ended_ = false;
};

}  // namespace tricoil::host::json_lines

// Sends each pose as a line to standard output.
#pragma once

#include "board/host/serve/service.hpp"
#include "board/linux/line_pump.hpp"
#include "board/pose_text/pose_fields.hpp"

namespace tricoil::host::json_lines {

/// A reader that is too slow misses whole lines. When the reader closes the pipe or the disk is full, the program
/// ends as on SIGTERM.
class StdoutSender final : public Service {
public:
    explicit StdoutSender(const PoseUnits& units);

    bool watch(std::vector<pollfd>& /*descriptors*/) override { return false; }
    void handle() override {}
    void take(std::span<const ServedPose> poses) override;

    /// Writes the remaining lines. Throws DeviceError if the disk is full or lines were dropped.
    void finish();

private:
    PoseUnits units_;
    linux_board::LinePump pump_;
    bool has_ended_ = false;
};

}  // namespace tricoil::host::json_lines

#include "board/host/serve/json_lines/stdout_sender.hpp"

#include <unistd.h>

#include <csignal>

#include "board/pose_text/served_pose.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host::json_lines {

StdoutSender::StdoutSender(const PoseUnits& units) : units_(units), pump_(STDOUT_FILENO, "standard output") {}

void StdoutSender::take(std::span<const ServedPose> poses) {
    for (const ServedPose& served : poses) {
        pump_.push(served_pose_line(served, units_));
    }
    if (pump_.has_failed() && !has_ended_) {
        has_ended_ = true;
        (void)std::raise(SIGTERM);
    }
}

void StdoutSender::finish() {
    const std::string error = pump_.close();
    if (!error.empty() && !pump_.is_unread()) {
        throw DeviceError(error);
    }
}

}  // namespace tricoil::host::json_lines

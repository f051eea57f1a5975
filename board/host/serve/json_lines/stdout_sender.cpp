#include "board/host/serve/json_lines/stdout_sender.hpp"

#include <unistd.h>

#include <csignal>

#include "board/pose_text/served_pose_line.hpp"

namespace tricoil::host::json_lines {

StdoutSender::StdoutSender() : pump_(STDOUT_FILENO, "standard output") {}

void StdoutSender::take(std::span<const ServedPose> poses) {
    for (const ServedPose& served : poses) {
        pump_.push(served_pose_line(served));
    }
    if (pump_.is_unread() && !has_ended_) {
        has_ended_ = true;
        (void)std::raise(SIGTERM);
    }
}

}  // namespace tricoil::host::json_lines

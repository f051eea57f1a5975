// Session of one client of JSON lines.
#pragma once

#include <span>

#include "board/host/serve/stream.hpp"
#include "board/pose_text/served_pose.hpp"

namespace tricoil::host::json_lines {

/// Sends every new pose, valid or not, and the stale pose that SilenceWatch adds. Input from the client is ignored. A client that
/// reads too slowly misses whole lines.
class Session {
public:
    Session(Stream& stream, const PoseUnits& units) : stream_(stream), units_(units) {}

    void receive(std::span<const char> /*bytes*/) {}
    void take(std::span<const ServedPose> poses) {
        for (const ServedPose& served : poses) {
            stream_.send(served_pose_line(served, units_));
        }
    }

private:
    Stream& stream_;
    PoseUnits units_;
};

}  // namespace tricoil::host::json_lines

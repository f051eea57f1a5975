// Poses as an MCAP file with JSON messages, for Foxglove and PlotJuggler.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string_view>

#include "board/pose_text/mcap/mcap_writer.hpp"
#include "board/pose_text/pose_fields.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

/// Two topics for each sensor N: /sensorN/tracker has all poses with the fields of JSON lines (schema tricoil.Pose);
/// /sensorN/pose has the valid poses as foxglove.PoseInFrame. Times are those of the poses, in ns.
class McapPoses {
public:
    /// units: of /sensorN/tracker; frame: frame_id of /sensorN/pose.
    McapPoses(std::function<void(std::string_view)> put, PoseUnits units, std::string frame = "source");

    void add(const tracking::PoseEstimate<double>& pose);
    void finish() { writer_.finish(); }

private:
    struct Channels {
        std::uint16_t tracker;
        std::uint16_t pose;
    };
    McapWriter writer_;
    PoseUnits units_;
    std::string frame_;
    std::array<std::optional<Channels>, tracking::kMaxSensors> sensors_;
};

}  // namespace tricoil::host

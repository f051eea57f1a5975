// Writes and parses lines of a recording. Numbers are the shortest decimals that read back as the same bits.
#pragma once

#include <string>
#include <string_view>

#include "board/record/recording_format.hpp"
#include "core/signal/column.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

/// One input of a tracker.
struct TrackerInput {
    InputKind kind = InputKind::column;
    std::uint8_t sensor = 0;
    MeasuredColumn<double> column;  // kind: column
    DeviceTime now{};               // kind: tick
    Vec3<double> hemisphere = Vec3<double>::Zero();
};

/// True for a column of the first sensor that measures couplings, in either band.
bool has_couplings(const TrackerInput& input);

std::string line_of(const TrackerInput& input);
std::string line_of(const tracking::PoseEstimate<double>& estimate);

/// Throws InputError, beginning with `where`, if the line is not an input.
TrackerInput parse_input(std::string_view line, const std::string& where);
/// Restores only the total of the predicted error. Throws like parse_input().
tracking::PoseEstimate<double> parse_pose(std::string_view line, const std::string& where);

}  // namespace tricoil::host

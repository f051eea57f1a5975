// Writes and parses lines of a recording. Numbers are the shortest decimals that read back as the same bits.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "core/signal/column.hpp"
#include "core/solver/refine.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

// A recording is a folder with a description and three line files. README.md describes it.
constexpr const char* kRecordingFormat = "tricoil recording";
constexpr int kRecordingVersion = 4;
constexpr int kOldestRecordingVersion = 3;  // without gain steps and levels
constexpr const char* kDescriptionFile = "recording.json";

/// Line files.
enum class RecordFile : std::size_t { inputs, poses, events };
constexpr std::array<const char*, 3> kRecordFiles{"inputs.csv", "poses.csv", "events.csv"};

/// Kinds of input lines. `begin`: the trackers were created again.
constexpr std::array<const char*, 4> kInputKinds{"column", "tick", "hemisphere", "begin"};
enum class InputKind : std::size_t { column, tick, hemisphere, begin };

/// Header of each file.
const std::array<std::string, 3>& record_headers();

/// Header of the inputs in recordings without gain steps and levels, which are also read.
std::string_view old_input_header();

/// One input of a tracker.
struct TrackerInput {
    InputKind kind = InputKind::column;
    std::uint8_t sensor = 0;
    MeasuredColumn<double> column{};  // kind: column
    DeviceTime now{};                 // kind: tick
    Vec3<double> hemisphere = Vec3<double>::Zero();
};

/// Event `truth`: true pose of a simulated sensor at the time of a pose, source frame.
struct TrueSensor {
    std::uint8_t sensor = 0;
    DeviceTime time{};
    solver::RigidPose<double> pose{};
};

/// True for a column of the first sensor that measures couplings, in either band.
bool has_couplings(const TrackerInput& input);

std::string line_of(const TrackerInput& input);
std::string line_of(const tracking::PoseEstimate<double>& estimate);
std::string line_of(const TrueSensor& truth);

/// Throws InputError, beginning with `where`, if the line is not an input.
TrackerInput parse_input(std::string_view line, const std::string& where);
/// Restores only the total of the predicted error. Throws like parse_input().
tracking::PoseEstimate<double> parse_pose(std::string_view line, const std::string& where);
/// Nullopt for another event. Throws like parse_input().
std::optional<TrueSensor> parse_truth(std::string_view line, const std::string& where);

}  // namespace tricoil::host

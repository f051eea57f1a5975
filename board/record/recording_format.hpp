// Format of a recording: a folder with a description and three line files. README.md describes it.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

namespace tricoil::host {

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

}  // namespace tricoil::host

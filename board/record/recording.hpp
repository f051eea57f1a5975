// Reads a recording line by line, after a check of its files.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "board/record/record_lines.hpp"
#include "board/record/tracker_settings.hpp"
#include "board/support/line_reader.hpp"

namespace tricoil::host {

/// Lines of one file, as in the newest version, without its header and without an incomplete last line.
class RecordLines {
public:
    /// Throws InputError if the file is missing or has a different header. A file without a complete line counts as empty.
    RecordLines(const std::string& folder, RecordFile file);

    /// Reads the next line; false at the end. Throws ReadError if the disk fails.
    bool next(std::string& line);
    /// Part of the file that was read, 0 to 1.
    [[nodiscard]] double share() const { return reader_.share(); }
    /// "FILE:LINE" of the last line read.
    [[nodiscard]] std::string where() const { return path_ + ":" + std::to_string(reader_.line()); }

private:
    static constexpr std::string_view kUnknownLevels = ",0,0,0,0";  // gain step and levels, which version 3 does not have

    std::string path_;
    LineReader reader_;
    std::string_view added_;  // to each line
};

class Recording {
public:
    /// Throws InputError, naming file and reason, if the folder is not a recording, has another version or is damaged,
    /// DeviceError if the disk fails. each_block: called after every 64 KiB while the files are checked; it may throw; may be
    /// empty.
    explicit Recording(const std::string& folder, const std::function<void()>& each_block = {});

    [[nodiscard]] const std::string& folder() const { return folder_; }
    [[nodiscard]] const nlohmann::json& description() const { return description_; }
    /// Empty if the device computed the poses: there are no columns to replay.
    [[nodiscard]] const std::optional<TrackerSettings>& settings() const { return settings_; }
    /// Number of sensors, or the most that there can be.
    [[nodiscard]] int sensors() const { return settings_ ? settings_->sensors : tracking::kMaxSensors; }
    /// True if the recording was completed. Otherwise the program was killed or the recording failed.
    [[nodiscard]] bool complete() const { return complete_; }

    /// True if the trackers ran before the recording began. The first poses of a replay may then differ.
    [[nodiscard]] bool midway() const { return description_.value("midway", nlohmann::json()) == true; }

    /// Throws InputError if the output file `path` lies in the recording's folder.
    void refuse_as_output(const std::string& path) const;

private:
    void check_file(const char* name, const nlohmann::json& extent, const std::function<void()>& each_block) const;

    std::string folder_;
    nlohmann::json description_;
    std::optional<TrackerSettings> settings_;
    bool complete_ = false;
};

}  // namespace tricoil::host

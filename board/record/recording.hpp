// Reads a recording back: checked before it is used, line by line.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "board/record/record_lines.hpp"
#include "board/record/tracker_settings.hpp"
#include "board/support/line_reader.hpp"

namespace tricoil::host {

/// The lines of one of the files; without its header, and without a last one that was cut off.
class RecordLines {
public:
    /// Throws InputError if the file is not there or has another header; without any whole line it holds nothing.
    RecordLines(const std::string& folder, RecordFile file);

    /// False at the end. Throws ReadError if the disk fails.
    bool next(std::string& line);
    /// "FILE:LINE" of the last one.
    [[nodiscard]] std::string where() const { return path_ + ":" + std::to_string(reader_.line()); }

private:
    std::string path_;
    LineReader reader_;
};

class Recording {
public:
    /// Throws InputError, naming file and reason, for what is no recording, is of another version, or was damaged since.
    explicit Recording(const std::string& folder);

    [[nodiscard]] const std::string& folder() const { return folder_; }
    [[nodiscard]] const nlohmann::json& description() const { return description_; }
    /// Nothing for a device that tracks by itself: it has no columns to replay.
    [[nodiscard]] const std::optional<TrackerSettings>& settings() const { return settings_; }
    /// Whether it was ended in order; else the program was killed or the disk was full.
    [[nodiscard]] bool complete() const { return complete_; }

    /// Whether the trackers had been at work before it began: then a replay cannot equal it from its first pose on.
    [[nodiscard]] bool midway() const { return description_.value("midway", nlohmann::json()) == true; }

    /// Throws InputError if `path`, which is about to be written, lies in the recording's folder.
    void refuse_as_output(const std::string& path) const;

private:
    void check_file(const char* name, const nlohmann::json& extent) const;

    std::string folder_;
    nlohmann::json description_;
    std::optional<TrackerSettings> settings_;
    bool complete_ = false;
};

}  // namespace tricoil::host

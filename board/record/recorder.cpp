#include "board/record/recorder.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "board/pose_text/flag_names.hpp"
#include "board/record/record_lines.hpp"
#include "board/record/tracker_settings.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/output_file.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

namespace fs = std::filesystem;

/// Paths of the journal's files. Creates the folder; it must be empty.
std::vector<std::string> prepare(const std::string& folder) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (!fs::is_directory(folder)) {
        throw InputError(fmt::format("{}: cannot create the folder ({}); choose another --record", folder, error.message()));
    }
    refuse_if(!fs::is_empty(folder, error) || error, "{}: the folder is not empty; record into a new folder", folder);
    std::vector<std::string> paths;
    for (const char* name : kRecordFiles) {
        paths.push_back((fs::path(folder) / name).string());
    }
    return paths;
}

std::string now_utc() {
    return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}",
                       fmt::gmtime(std::chrono::system_clock::to_time_t(std::chrono::system_clock::now())));
}

nlohmann::ordered_json describe_columns() {
    nlohmann::ordered_json columns;
    for (std::size_t n = 0; n < kRecordFiles.size(); ++n) {
        columns[kRecordFiles[n]] = record_headers()[n];
    }
    return columns;
}

}  // namespace

Recorder::Recorder(const std::string& folder, nlohmann::ordered_json source, Journal::WhenFull when_full)
    : folder_(folder), journal_(prepare(folder), when_full, record_headers(), [this] {
          print_notice("tricoil: {}; tracking continues\n", failure());
      }) {
    description_ = {{"format", kRecordingFormat},
                    {"version", kRecordingVersion},
                    {"program", "tricoil " TRICOIL_VERSION},
                    {"started", now_utc()},
                    {"source", std::move(source)},
                    {"trackers", nullptr},
                    {"midway", false},
                    {"conventions",
                     "positions in m, small rotations in rad, both in the source frame; q converts sensor components to source "
                     "components; times in microseconds of the device; couplings in the demodulator's unit"},
                    {"columns", describe_columns()},
                    {"complete", false}};
    describe_now();
}

Recorder::~Recorder() { close(); }

std::string Recorder::description_path() const { return (fs::path(folder_) / kDescriptionFile).string(); }

/// Names that are not UTF-8 do not end a recording.
std::string Recorder::description_text() const { return json_line(description_, 2) + "\n"; }

void Recorder::describe_now() {
    try {
        write_whole_file(description_path(), description_text());
    } catch (const std::exception& error) {
        journal_.fail(error.what());
    }
}

void Recorder::append(RecordFile file, const std::string& line) { journal_.append(static_cast<std::size_t>(file), line); }

std::string Recorder::failure() const {
    std::error_code ignored;  // of a disk that is gone
    const char* const rest =
        fs::exists(description_path(), ignored) ? "the recorded part can be replayed" : "nothing can be replayed";
    return fmt::format("{}: recording ended early ({}); {}", folder_, journal_.reason(), rest);
}

void Recorder::event(std::uint8_t sensor, const std::string& what, const std::string& detail) {
    std::string safe = detail;
    std::replace(safe.begin(), safe.end(), ',', ';');
    append(RecordFile::events, fmt::format("{},{},{},{}", time_us_, sensor, what, safe));
}

void Recorder::do_begin(const Settings& settings) {
    nlohmann::ordered_json made = settings_json(settings);
    if (settings_ && *settings_ != made) {
        journal_.fail("the device reconnected with other settings");
        return;
    }
    if (!settings_) {
        settings_ = made;
        description_["trackers"] = std::move(made);
        journal_.write_whole(description_path(), description_text());
    }
    append(RecordFile::inputs, line_of(TrackerInput{.kind = InputKind::begin}));
    event(0, "begin", "");
}

void Recorder::begin_while_running(const Settings& settings, std::span<const Vec3<double>> positions_m) {
    description_["midway"] = true;
    begin(settings);
    for (std::size_t n = 0; n < static_cast<std::size_t>(settings.sensors); ++n) {
        hemisphere(static_cast<std::uint8_t>(n), positions_m[n]);
    }
}

void Recorder::do_column(const MeasuredColumn<double>& column) {
    time_us_ = to_us(column.midpoint);
    append(RecordFile::inputs, line_of(TrackerInput{.column = column}));
}

void Recorder::do_tick(std::uint8_t sensor, DeviceTime now) {
    time_us_ = to_us(now);
    append(RecordFile::inputs, line_of(TrackerInput{.kind = InputKind::tick, .sensor = sensor, .now = now}));
}

void Recorder::do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) {
    append(RecordFile::inputs, line_of(TrackerInput{.kind = InputKind::hemisphere, .sensor = sensor, .hemisphere = towards}));
    event(sensor, "hemisphere", fmt::format("{} {} {}", towards.x(), towards.y(), towards.z()));
}

void Recorder::do_truth(std::uint8_t sensor, DeviceTime time, const solver::RigidPose<double>& pose) {
    append(RecordFile::events, line_of(TrueSensor{sensor, time, pose}));
}

void Recorder::do_pose(const tracking::PoseEstimate<double>& estimate) {
    append(RecordFile::poses, line_of(estimate));
    if (estimate.sensor < flags_.size() && !(flags_[estimate.sensor] == estimate.flags)) {
        flags_[estimate.sensor] = estimate.flags;
        event(estimate.sensor, "flags", estimate.flags.empty() ? "none" : to_text(estimate.flags));
    }
}

void Recorder::do_fault(std::string_view text) { event(0, "fault", std::string(text)); }

std::string Recorder::close() {
    if (closed_) {
        return "";
    }
    closed_ = true;
    const auto extents = journal_.close();
    if (failed()) {
        description_["failure"] = journal_.reason();
    } else {
        nlohmann::ordered_json files;
        for (std::size_t n = 0; n < extents.size(); ++n) {
            files[kRecordFiles[n]] = {{"lines", extents[n].lines}, {"bytes", extents[n].bytes}, {"crc32", extents[n].crc32}};
        }
        description_["complete"] = true;
        description_["files"] = files;
    }
    describe_now();
    return failed() ? failure() : "";
}

}  // namespace tricoil::host

#include "board/host/serve/recording_switch.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <filesystem>

namespace tricoil::host {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMinRoom = std::uintmax_t{4} << 20U;  // free bytes on the disk: about 10 s of one sensor at 240 frames/s

/// Reason why no recording can start in `folder`; empty if it can.
std::string refusal(const std::string& folder) {
    if (folder.empty()) {
        return "recording needs tricoil serve --record-folder FOLDER";
    }
    std::error_code error;
    const fs::space_info room = fs::space(folder, error);
    if (!error && room.available < kMinRoom) {
        return fmt::format("{}: only {} KiB free, too little for a recording; free disk space", folder, room.available / 1024);
    }
    return "";
}

}  // namespace

std::string RecordingSwitch::record(bool on) {
    const std::lock_guard asking(asking_);
    if (on == status().on) {
        return on ? "already recording" : "no recording is running";
    }
    return on ? begin_recording() : end_recording();
}

RecordingStatus RecordingSwitch::status() {
    std::unique_ptr<Recorder> dead;
    {
        const std::lock_guard lock(mutex_);
        if (!died_) {
            return {recorder_ != nullptr, error_};
        }
        dead = std::move(recorder_);
        died_ = false;
    }
    const std::string error = dead->close();
    const std::lock_guard lock(mutex_);
    error_ = error;
    return {recorder_ != nullptr, error_};
}

std::string RecordingSwitch::begin_recording() {
    if (const std::string reason = refusal(folder_); !reason.empty()) {
        return reason;
    }
    const std::string name = fmt::format("{:%Y-%m-%dT%H%M%SZ}", fmt::gmtime(std::time(nullptr)));
    const fs::path path = fs::path(folder_) / name;
    std::unique_ptr<Recorder> recorder;
    std::error_code ignored;
    const bool was_there = fs::exists(path, ignored);
    try {
        recorder = std::make_unique<Recorder>(path.string(), source_, Journal::WhenFull::end);
    } catch (const std::exception& error) {
        return error.what();
    }
    if (recorder->failed()) {  // the description of the recording could not be written
        recorder.reset();
        if (!was_there) {
            fs::remove_all(path, ignored);
        }
        return path.string() + ": cannot start a recording; is the disk full?";
    }
    take_over(std::move(recorder));
    return "recording into " + name;
}

void RecordingSwitch::take_over(std::unique_ptr<Recorder> recorder) {
    const std::lock_guard lock(mutex_);
    recorder_ = std::move(recorder);
    error_.clear();
    died_ = false;
    if (settings_) {
        recorder_->begin_while_running(*settings_, last_m_);
    }
}

std::string RecordingSwitch::end_recording() {
    std::unique_ptr<Recorder> recorder;
    {
        const std::lock_guard lock(mutex_);
        recorder = std::move(recorder_);
        died_ = false;
        if (!recorder) {  // the recording has failed and status() has closed it
            return error_;
        }
    }
    const std::string error = recorder->close();
    const std::lock_guard lock(mutex_);
    error_ = error;
    return error.empty() ? "recorded" : error;
}

void RecordingSwitch::do_begin(const Settings& settings) {
    const std::lock_guard lock(mutex_);
    settings_ = settings;
    if (recorder_) {
        recorder_->begin(settings);
    }
}

void RecordingSwitch::do_column(const Column<double>& column) {
    const std::lock_guard lock(mutex_);
    if (recorder_) {
        recorder_->column(column);
    }
}

void RecordingSwitch::do_tick(std::uint8_t sensor, DeviceTime now) {
    const std::lock_guard lock(mutex_);
    if (recorder_) {
        recorder_->tick(sensor, now);
    }
}

void RecordingSwitch::do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) {
    const std::lock_guard lock(mutex_);
    if (recorder_) {
        recorder_->hemisphere(sensor, towards);
    }
}

void RecordingSwitch::do_pose(const tracking::PoseEstimate<double>& estimate) {
    const std::lock_guard lock(mutex_);
    if (estimate.valid() && estimate.sensor < last_m_.size()) {
        last_m_[estimate.sensor] = estimate.position_m;
    }
    if (recorder_) {
        died_ = recorder_->failed();  // before pose(), which prints the failure if it is not printed yet
        recorder_->pose(estimate);
    }
}

}  // namespace tricoil::host

#include "board/host/serve/recording_switch.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <filesystem>

namespace tricoil::host {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kLeastRoom = std::uintmax_t{4} << 20U;  // bytes: less than a minute's columns

/// Reason why no recording can start in `folder`; empty if it can.
std::string refusal(const std::string& folder) {
    if (folder.empty()) {
        return "start tricoil serve with --record-folder to record from here";
    }
    std::error_code error;
    const fs::space_info room = fs::space(folder, error);
    if (!error && room.available < kLeastRoom) {
        return fmt::format("{}: the disk has {} KiB left, too few for a recording; make room", folder, room.available / 1024);
    }
    return "";
}

}  // namespace

std::string RecordingSwitch::record(bool on) {
    const std::lock_guard asking(asking_);
    if (on == status().on) {
        return on ? "is recording" : "is not recording";
    }
    return on ? begin_recording() : end_recording();
}

RecordingStatus RecordingSwitch::status() {
    std::unique_ptr<Recorder> dead;
    {
        const std::lock_guard lock(mutex_);
        if (!died_) {
            return {recorder_ != nullptr, trouble_};
        }
        dead = std::move(recorder_);
        died_ = false;
    }
    const std::string trouble = dead->close();
    const std::lock_guard lock(mutex_);
    trouble_ = trouble;
    return {recorder_ != nullptr, trouble_};
}

std::string RecordingSwitch::begin_recording() {
    if (const std::string why = refusal(folder_); !why.empty()) {
        return why;
    }
    const std::string name = fmt::format("{:%Y-%m-%dT%H%M%SZ}", fmt::gmtime(std::time(nullptr)));
    const fs::path path = fs::path(folder_) / name;
    std::unique_ptr<Recorder> recorder;
    std::error_code ignored;
    const bool was_there = fs::exists(path, ignored);
    try {
        recorder = std::make_unique<Recorder>(path.string(), source_, Journal::Patience::never_wait);
    } catch (const std::exception& error) {
        return error.what();
    }
    if (recorder->failed()) {  // its description cannot be written
        recorder.reset();
        if (!was_there) {
            fs::remove_all(path, ignored);
        }
        return path.string() + ": no recording can be begun there; is the disk full?";
    }
    take_over(std::move(recorder));
    return "recording into " + name;
}

void RecordingSwitch::take_over(std::unique_ptr<Recorder> recorder) {
    const std::lock_guard lock(mutex_);
    recorder_ = std::move(recorder);
    trouble_.clear();
    died_ = false;
    if (settings_) {
        recorder_->begin_midway(*settings_, last_m_);
    }
}

std::string RecordingSwitch::end_recording() {
    std::unique_ptr<Recorder> recorder;
    {
        const std::lock_guard lock(mutex_);
        recorder = std::move(recorder_);
        died_ = false;
        if (!recorder) {  // it has just failed
            return trouble_;
        }
    }
    const std::string trouble = recorder->close();
    const std::lock_guard lock(mutex_);
    trouble_ = trouble;
    return trouble.empty() ? "recorded" : trouble;
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
        died_ = recorder_->failed();  // checked before the pose, so that the reason is reported first
        recorder_->pose(estimate);
    }
}

}  // namespace tricoil::host

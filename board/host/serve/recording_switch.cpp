#include "board/host/serve/recording_switch.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <filesystem>

namespace tricoil::host {

std::string RecordingSwitch::record(bool on) {
    const std::lock_guard asking(asking_);
    if (on == recording()) {
        return on ? "is recording" : "is not recording";
    }
    return on ? begin_recording() : end_recording();
}

bool RecordingSwitch::recording() const {
    const std::lock_guard lock(mutex_);
    return recorder_ != nullptr;
}

std::string RecordingSwitch::begin_recording() {
    if (folder_.empty()) {
        return "start tricoil serve with --record-folder to record from here";
    }
    const std::string name = fmt::format("{:%Y-%m-%dT%H%M%SZ}", fmt::gmtime(std::time(nullptr)));
    std::unique_ptr<Recorder> recorder;
    try {
        recorder =
            std::make_unique<Recorder>((std::filesystem::path(folder_) / name).string(), source_, Journal::Patience::never_wait);
    } catch (const std::exception& error) {
        return error.what();
    }
    const std::lock_guard lock(mutex_);
    recorder_ = std::move(recorder);
    if (settings_) {
        recorder_->begin_midway(*settings_, last_m_);
    }
    return "recording into " + name;
}

std::string RecordingSwitch::end_recording() {
    std::unique_ptr<Recorder> recorder;
    {
        const std::lock_guard lock(mutex_);
        recorder = std::move(recorder_);
    }
    const std::string trouble = recorder->close();
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
        recorder_->pose(estimate);
    }
}

}  // namespace tricoil::host

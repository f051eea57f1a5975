#include "board/host/serve/recording_switch.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <ctime>
#include <filesystem>

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMinRoom = std::uintmax_t{4} << 20U;  // free bytes on the disk: about 10 s of one sensor at 240 frames/s

/// Throws InputError if no recording can start in `folder`.
void check_room(const std::string& folder) {
    refuse_if(folder.empty(), "recording needs tricoil serve --record-folder FOLDER");
    std::error_code error;
    const fs::space_info room = fs::space(folder, error);
    refuse_if(!error && room.available < kMinRoom, "only {} KiB free, too little for a recording; free disk space",
              room.available / 1024);
}

}  // namespace

bool is_recording_name(std::string_view name) {
    constexpr std::size_t kLongest = 64;
    constexpr std::string_view kSigns = " -_.,+()=";
    const auto is_allowed = [&](char c) {
        return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
               kSigns.find(c) != std::string_view::npos;
    };
    return !name.empty() && name.size() <= kLongest && std::string_view(".- ").find(name.front()) == std::string_view::npos &&
           name.back() != ' ' && std::all_of(name.begin(), name.end(), is_allowed);
}

std::string without_folder(std::string message, const std::string& folder) {
    const std::string prefix = (fs::path(folder) / "").string();
    for (auto at = message.find(prefix); !prefix.empty() && at != std::string::npos; at = message.find(prefix)) {
        message.erase(at, prefix.size());
    }
    return message;
}

std::string RecordingSwitch::record(bool on, const std::string& name) {
    const std::lock_guard asking(asking_);
    if (on == status().on) {
        return on ? "already recording" : "no recording is running";
    }
    return on ? begin_recording(name) : end_recording();
}

RecordingStatus RecordingSwitch::status() {
    std::unique_ptr<Recorder> dead;
    {
        const std::lock_guard lock(mutex_);
        if (!recorder_ || !recorder_->failed()) {
            return status_locked();
        }
        dead = std::move(recorder_);
    }
    const std::string error = without_folder(dead->close(), folder_);
    const std::lock_guard lock(mutex_);
    error_ = error;
    return status_locked();
}

RecordingStatus RecordingSwitch::status_locked() const {
    RecordingStatus status{recorder_ != nullptr, error_, {}};
    if (recorder_) {
        status.name = name_;
        status.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
        status.bytes = recorder_->bytes();
    }
    return status;
}

std::string RecordingSwitch::begin_recording(const std::string& wanted) {
    check_room(folder_);
    refuse_if(!wanted.empty() && !is_recording_name(wanted),
              "the name may have up to 64 letters, digits, spaces and -_.,+()=, and must not begin with a dot or a hyphen");
    const std::string name = wanted.empty() ? fmt::format("{:%Y-%m-%dT%H%M%SZ}", fmt::gmtime(std::time(nullptr))) : wanted;
    const fs::path path = fs::path(folder_) / name;
    std::unique_ptr<Recorder> recorder;
    std::error_code ignored;
    const bool was_there = fs::exists(path, ignored);
    refuse_if(!wanted.empty() && was_there, "{} exists; choose another name", name);
    try {
        recorder = std::make_unique<Recorder>(path.string(), source_, Journal::WhenFull::end);
    } catch (const std::exception& error) {
        throw InputError(without_folder(error.what(), folder_));
    }
    if (recorder->failed()) {  // the description of the recording could not be written
        recorder.reset();
        if (!was_there) {
            fs::remove_all(path, ignored);
        }
        throw InputError(name + ": cannot start a recording; is the disk full?");
    }
    take_over(std::move(recorder), name);
    return "recording into " + name;
}

void RecordingSwitch::take_over(std::unique_ptr<Recorder> recorder, const std::string& name) {
    const std::lock_guard lock(mutex_);
    recorder_ = std::move(recorder);
    name_ = name;
    started_ = std::chrono::steady_clock::now();
    error_.clear();
    if (settings_) {
        recorder_->begin_while_running(*settings_, last_m_);
    }
}

std::string RecordingSwitch::end_recording() {
    std::unique_ptr<Recorder> recorder;
    {
        const std::lock_guard lock(mutex_);
        recorder = std::move(recorder_);
        if (!recorder) {  // the recording has failed and status() has closed it
            return error_;
        }
    }
    const std::string error = without_folder(recorder->close(), folder_);
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

template <typename Call>
void RecordingSwitch::pass(const Call& call) {
    const std::lock_guard lock(mutex_);
    if (recorder_) {
        call(*recorder_);
    }
}

void RecordingSwitch::do_column(const MeasuredColumn<double>& column) {
    pass([&](Recorder& recorder) { recorder.column(column); });
}

void RecordingSwitch::do_tick(std::uint8_t sensor, DeviceTime now) {
    pass([&](Recorder& recorder) { recorder.tick(sensor, now); });
}

void RecordingSwitch::do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) {
    pass([&](Recorder& recorder) { recorder.hemisphere(sensor, towards); });
}

void RecordingSwitch::do_truth(std::uint8_t sensor, DeviceTime time, const solver::RigidPose<double>& pose) {
    pass([&](Recorder& recorder) { recorder.truth(sensor, time, pose); });
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

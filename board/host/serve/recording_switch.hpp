// Recording that a client starts and stops while the tracker runs.
#pragma once

#include <array>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "board/page/pose_event.hpp"
#include "board/record/recorder.hpp"

namespace tricoil::host {

/// True for 1 to 64 letters, digits, spaces and -_.,+()= that do not begin with a dot or a hyphen or end with a space: such a
/// name cannot leave its folder, is no option of a program, and needs no quotes that a shell does not have.
bool is_recording_name(std::string_view name);

/// The message without the path of the folder, which is not for clients.
std::string without_folder(std::string message, const std::string& folder);

/// Creates and closes recordings in the caller's thread. The tracker's thread never waits for the disk: no system call is made
/// while `mutex_` is locked.
class RecordingSwitch final : public tracking::TrackerTap<double> {
public:
    /// folder: parent of the recordings, which are named by the client or by their start time (UTC); empty: recordings are
    /// refused. source: origin of the columns.
    RecordingSwitch(std::string folder, nlohmann::ordered_json source) : folder_(std::move(folder)), source_(std::move(source)) {}

    /// Starts or stops a recording. name: of one that starts; empty: its time. Returns, or throws as InputError, text for the
    /// client.
    std::string record(bool on, const std::string& name = {});
    /// Also closes a recording that has failed, for example on a full disk.
    [[nodiscard]] RecordingStatus status();

    [[nodiscard]] const std::string& folder() const { return folder_; }
    [[nodiscard]] const nlohmann::ordered_json& source() const { return source_; }

private:
    void do_begin(const Settings& settings) override;
    void do_column(const MeasuredColumn<double>& column) override;
    void do_tick(std::uint8_t sensor, DeviceTime now) override;
    void do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) override;
    void do_truth(std::uint8_t sensor, DeviceTime time, const solver::RigidPose<double>& pose) override;
    void do_pose(const tracking::PoseEstimate<double>& estimate) override;

    template <typename Call>
    void pass(const Call& call);
    std::string begin_recording(const std::string& wanted);
    void take_over(std::unique_ptr<Recorder> recorder, const std::string& name);
    [[nodiscard]] RecordingStatus status_locked() const;
    std::string end_recording();

    std::string folder_;
    nlohmann::ordered_json source_;
    std::mutex asking_;  // one request at a time
    std::mutex mutex_;   // between tracker and clients
    std::unique_ptr<Recorder> recorder_;
    std::string error_;
    std::string name_;  // of recorder_
    std::chrono::steady_clock::time_point started_;
    std::optional<Settings> settings_;
    std::array<Vec3<double>, tracking::kMaxSensors> last_m_{Vec3<double>::Zero(), Vec3<double>::Zero(), Vec3<double>::Zero(),
                                                            Vec3<double>::Zero()};  // last valid positions
};

}  // namespace tricoil::host

// Recording that a client starts and stops while the tracker runs.
#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "board/record/recorder.hpp"

namespace tricoil::host {

struct RecordingStatus {
    bool on = false;
    std::string error;  // failure of the last recording, one line; empty: none
};

/// Creates and closes recordings in the caller's thread. The tracker's thread waits for the disk only while the description of a
/// recording is written, once at its start.
class RecordingSwitch final : public tracking::TrackerTap<double> {
public:
    /// folder: parent of the recordings, which are named by their start time (UTC); empty: recordings are refused. source:
    /// origin of the columns.
    RecordingSwitch(std::string folder, nlohmann::ordered_json source) : folder_(std::move(folder)), source_(std::move(source)) {}

    /// Starts or stops a recording. Returns the result as text for the client.
    std::string record(bool on);
    /// Also closes a recording that has failed, for example on a full disk.
    [[nodiscard]] RecordingStatus status();

private:
    void do_begin(const Settings& settings) override;
    void do_column(const Column<double>& column) override;
    void do_tick(std::uint8_t sensor, DeviceTime now) override;
    void do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) override;
    void do_pose(const tracking::PoseEstimate<double>& estimate) override;

    std::string begin_recording();
    void take_over(std::unique_ptr<Recorder> recorder);
    std::string end_recording();

    std::string folder_;
    nlohmann::ordered_json source_;
    std::mutex asking_;  // one request at a time
    std::mutex mutex_;   // between tracker and clients
    std::unique_ptr<Recorder> recorder_;
    bool died_ = false;  // recorder_ has failed and has printed its failure
    std::string error_;
    std::optional<Settings> settings_;
    std::array<Vec3<double>, tracking::kMaxSensors> last_m_{Vec3<double>::Zero(), Vec3<double>::Zero(), Vec3<double>::Zero(),
                                                            Vec3<double>::Zero()};  // last valid positions
};

}  // namespace tricoil::host

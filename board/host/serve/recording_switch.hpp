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
    std::string trouble;  // reason if the last recording ended by itself; otherwise empty
};

/// Creates and closes recordings in the caller's thread, so that the tracker's thread never waits for a disk.
class RecordingSwitch final : public tracking::TrackerTap<double> {
public:
    /// folder: parent of the recordings, which are named by their start time; empty: no recordings. source: origin of the
    /// columns.
    RecordingSwitch(std::string folder, nlohmann::ordered_json source) : folder_(std::move(folder)), source_(std::move(source)) {}

    /// Starts or stops a recording. Returns the result as text for the client.
    std::string record(bool on);
    /// Also ends a failed recording, for example on a full disk.
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
    bool died_ = false;  // recorder_ failed, and the failure was reported
    std::string trouble_;
    std::optional<Settings> settings_;
    std::array<Vec3<double>, tracking::kMaxSensors> last_m_{Vec3<double>::Zero(), Vec3<double>::Zero(), Vec3<double>::Zero(),
                                                            Vec3<double>::Zero()};  // last valid positions
};

}  // namespace tricoil::host

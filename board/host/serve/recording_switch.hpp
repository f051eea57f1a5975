// Recording that a client begins and ends while the tracker runs.
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
    std::string trouble;  // why the last one ended by itself; empty: it did not
};

/// Makes and closes recordings in the caller's thread; the tracker's thread waits for no disk.
class RecordingSwitch final : public hal::TrackerTap<double> {
public:
    /// folder: where recordings go, each named by its start; empty: nowhere. source: of the columns.
    RecordingSwitch(std::string folder, nlohmann::ordered_json source) : folder_(std::move(folder)), source_(std::move(source)) {}

    /// Begins or ends; what happened, for the one who asked.
    std::string record(bool on);
    /// Ends a recording that has died, as one on a full disk does.
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
    std::mutex asking_;  // one wish at a time
    std::mutex mutex_;   // between the tracker and those who ask
    std::unique_ptr<Recorder> recorder_;
    bool died_ = false;  // recorder_ has, and has said so
    std::string trouble_;
    std::optional<Settings> settings_;
    std::array<Vec3<double>, tracking::kMaxSensors> last_m_{Vec3<double>::Zero(), Vec3<double>::Zero(), Vec3<double>::Zero(),
                                                            Vec3<double>::Zero()};  // of valid poses
};

}  // namespace tricoil::host

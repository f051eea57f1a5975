// Plays a recording: a source of inputs, and the trackers that compute poses from inputs again.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "board/record/recording.hpp"
#include "core/tracking/methods/any_tracker.hpp"

namespace tricoil::host {

/// Settings of a recording with another tracker; empty: that of the recording. Nullopt if the device computed the poses. Throws
/// InputError for an unknown name, for settings that the tracker does not support, for a tracker without columns, and like
/// two_band_frame_s() for dual-band.
std::optional<TrackerSettings> settings_of(const Recording& recording, const std::string& tracker = {});

/// Passes on everything, and the poses that its trackers compute from the inputs.
class TrackerStage final : public tracking::TrackerTap<double> {
public:
    /// `next` must outlive this object.
    explicit TrackerStage(tracking::TrackerTap<double>& next) : next_(next) {}

private:
    void do_begin(const Settings& settings) override;
    void do_column(const MeasuredColumn<double>& column) override;
    void do_tick(std::uint8_t sensor, DeviceTime now) override;
    void do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) override;
    void do_pose(const tracking::PoseEstimate<double>& estimate) override { next_.pose(estimate); }

    tracking::TrackerTap<double>& next_;
    std::vector<std::unique_ptr<tracking::AnyTracker<double>>> trackers_;  // one per sensor
};

/// Passes the inputs of a recording to a tap, line by line. If the device computed the poses, these are passed.
class RecordingPlayer {
public:
    /// settings: of the trackers, see settings_of(). `tap` must outlive this object.
    RecordingPlayer(const Recording& recording, const std::optional<TrackerSettings>& settings,
                    tracking::TrackerTap<double>& tap);

    /// Reads the next line; false at the end. Throws InputError for a damaged line.
    bool read();
    /// Device time of the line; empty if it has none.
    [[nodiscard]] std::optional<DeviceTime> time() const;
    /// True if trackers begin with this line.
    [[nodiscard]] bool begins() const { return settings_ && input_.kind == InputKind::begin; }
    /// Passes the line to the tap. Throws InputError for a sensor that the settings do not have.
    void play();
    /// Part of the file that was read, 0 to 1.
    [[nodiscard]] double share() const { return lines_.share(); }

private:
    std::optional<TrackerSettings> settings_;  // empty: recorded poses
    tracking::TrackerTap<double>& tap_;
    RecordLines lines_;
    TrackerInput input_;
    tracking::PoseEstimate<double> pose_;
};

}  // namespace tricoil::host

// Inputs or poses of a recording, and the trackers that compute poses from inputs again.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "board/record/recording.hpp"
#include "board/stream/continued_sequence.hpp"
#include "board/stream/source.hpp"
#include "board/stream/stream_clock.hpp"
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

    /// The numbers of poses go on although trackers are new.
    void pass(std::optional<tracking::PoseEstimate<double>> pose);

    tracking::TrackerTap<double>& next_;
    std::vector<std::unique_ptr<tracking::AnyTracker>> trackers_;  // one per sensor
    std::array<ContinuedSequence, tracking::kMaxSensors> sequences_;
};

/// Passes the inputs of a recording to a tap, line by line. If the device computed the poses, these are passed.
class RecordedSource final : public Source {
public:
    /// settings: of the trackers, see settings_of(). `tap` must outlive this object.
    RecordedSource(const Recording& recording, const std::optional<TrackerSettings>& settings, tracking::TrackerTap<double>& tap);

    /// True if trackers begin with the line that was read last.
    [[nodiscard]] bool begins() const { return settings_ && input_.kind == InputKind::begin; }
    /// Lines that were passed.
    [[nodiscard]] std::uint64_t played() const { return played_; }
    /// Part of the file that was read, 0 to 1.
    [[nodiscard]] double share() const { return lines_.share(); }

private:
    bool advance(Microseconds patience) override;
    void rest() override {}
    bool set_hemisphere(std::size_t /*sensor*/, const Vec3<double>& /*towards*/) override { return false; }
    [[nodiscard]] Microseconds elapsed() const override { return stamps_.elapsed(); }
    [[nodiscard]] std::string status() const override { return has_ended_ ? "the recording has ended" : "reading a recording"; }

    bool read();
    void play();
    [[nodiscard]] std::optional<DeviceTime> time() const;

    std::optional<TrackerSettings> settings_;  // empty: recorded poses
    tracking::TrackerTap<double>& tap_;
    RecordLines lines_;
    TrackerInput input_;
    tracking::PoseEstimate<double> pose_;
    bool has_line_ = false;                    // read, and not passed yet
    StreamClock stamps_{Microseconds::max()};  // a recording has pauses, which are played
    std::uint64_t played_ = 0;
    bool has_ended_ = false;
};

/// Time between the frames of a recording in two bands: seconds, from the first frames without a gap. Throws InputError if the
/// recording has no columns of two bands, or a frame rate that the tracker for two bands does not support, and like RecordLines.
double two_band_frame_s(const std::string& recording);

}  // namespace tricoil::host

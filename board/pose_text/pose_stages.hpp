// Stages between a source of poses and its outputs: relative to a sensor, tip of a tool, alignment frame, boresight. Recordings
// keep the poses of the source: they are separate taps.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "board/pose_text/output_format.hpp"
#include "board/pose_text/relative_poses.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::host {

/// Passes everything to `next`, and the poses in the output frame.
class PoseStages final : public tracking::TrackerTap<double> {
public:
    using Pose = tracking::PoseEstimate<double>;

    /// `next` must outlive this object. Throws like make_output_format().
    PoseStages(const OutputOptions& options, tracking::TrackerTap<double>& next);

    [[nodiscard]] const PoseUnits& units() const { return format_.units; }
    /// The true pose at the time of `pose`, in its frame; reference: of the sensor of --relative-to, if there is one.
    [[nodiscard]] TruePose framed(const Pose& pose, const TruePose& truth, const TruePose* reference) const;
    /// Velocity and angular rate of the sensor, source frame, as those of the output. Not for relative poses. The boresight does
    /// not change them.
    void turn_rates(const Pose& pose, Vec3<double>& velocity_m_s, Vec3<double>& rate_rad_s) const;
    /// Passes the poses that wait for the reference sensor: the source has ended.
    void finish();

private:
    void do_begin(const Settings& settings) override;
    void do_column(const MeasuredColumn<double>& column) override { next_.column(column); }
    void do_tick(std::uint8_t sensor, DeviceTime now) override { next_.tick(sensor, now); }
    void do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) override;
    void do_truth(std::uint8_t sensor, DeviceTime time, const TruePose& pose) override;
    void do_pose(const Pose& estimate) override;
    void do_fault(std::string_view text) override { next_.fault(text); }
    void pass(const Pose& pose);
    /// The pose, which is relative already, at the tip and in the output frame.
    [[nodiscard]] Pose framed(const Pose& pose) const;
    [[nodiscard]] bool is_in_source_frame() const { return !relative_ && !is_aligned_; }

    tracking::TrackerTap<double>& next_;
    OutputFormat format_;
    bool is_aligned_;
    bool has_boresight_;
    std::array<std::optional<tracking::OutputFrame<double>>, tracking::kMaxSensors> boresighted_;  // from the first valid pose on
    std::optional<TruePose> truth_;                                                                // of the next pose
    std::optional<RelativePoses> relative_;
};

/// Passes poses to a function.
class PoseTap final : public tracking::TrackerTap<double> {
public:
    explicit PoseTap(std::function<void(const tracking::PoseEstimate<double>&)> sink) : sink_(std::move(sink)) {}

private:
    void do_pose(const tracking::PoseEstimate<double>& estimate) override { sink_(estimate); }

    std::function<void(const tracking::PoseEstimate<double>&)> sink_;
};

}  // namespace tricoil::host

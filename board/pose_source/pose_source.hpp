// Origin of poses for users' programs: a device, a simulation or a recording.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "board/stream/stream_loop.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/tool_tip.hpp"
#include "core/tracking/output_frame.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::host {

/// Buffers the poses of the trackers. When full, it drops the oldest.
class PoseQueue final : public tracking::TrackerTap<double> {
public:
    static constexpr std::size_t kCapacity = 256;  // 0.27 s at 960 Hz

    [[nodiscard]] bool empty() const { return size_ == 0; }
    /// Removes the oldest pose; valid until the next call. The queue must not be empty.
    const tracking::PoseEstimate<double>& pop();
    /// Number of dropped poses.
    [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

private:
    void do_pose(const tracking::PoseEstimate<double>& estimate) override;

    std::vector<tracking::PoseEstimate<double>> ring_ = std::vector<tracking::PoseEstimate<double>>(kCapacity);  // allocated once
    std::size_t begin_ = 0;
    std::size_t size_ = 0;
    std::uint64_t dropped_ = 0;
};

/// Only one thread at a time may use a source.
class PoseSource final {
public:
    enum class Event : std::uint8_t { pose, none, end };

    /// Makes the source that gives its poses to a tap. It may own what the source needs.
    using MakeSource = std::function<std::shared_ptr<Source>(tracking::TrackerTap<double>&)>;

    /// realtime: at the pace of the source's clock; otherwise as fast as poses are polled. Throws what `make` throws.
    PoseSource(const MakeSource& make, bool realtime);

    /// Waits for the next pose, at most `patience`. `pose` is set if the result is Event::pose; it is in the output frame of its
    /// sensor. Event::end: the simulation or recording has ended. Throws InputError for a damaged recording, DeviceError if the
    /// source fails.
    Event poll(Microseconds patience, tracking::PoseEstimate<double>& pose);

    /// Direction from the source to the half space of the sensor, source frame. Returns false for an unknown sensor, for a
    /// direction that is zero or not finite, and for a recording, whose hemisphere is part of the recording.
    bool set_hemisphere(std::size_t sensor, const Vec3<double>& towards);

    /// Tip of a tool, in the sensor frame, m, with the covariance of its calibration. Returns false if ToolTips refuses it.
    bool set_tip(std::size_t sensor, const Vec3<double>& tip_m, const Mat3<double>& covariance_m2 = Mat3<double>::Zero());

    /// Sets the boresight: the attitude of the last polled pose of the sensor reads as the identity. Returns false if that pose
    /// is not valid, or there is none.
    bool boresight(std::size_t sensor);

    /// Status as one line for the user; never empty.
    [[nodiscard]] std::string status() const { return one_line(source_->status()); }

    /// Poses that were dropped because poll() was not called often enough.
    [[nodiscard]] std::uint64_t dropped() const { return queue_.dropped(); }

private:
    struct Output {
        std::optional<tracking::OutputFrame<double>> frame;  // of the boresight; empty: none
        std::optional<Quat<double>> attitude;                // of the last polled pose, before the output frame; empty: not valid
    };

    PoseQueue queue_;
    std::shared_ptr<Source> source_;
    StreamLoop loop_;
    ToolTips tips_;
    std::array<Output, tracking::kMaxSensors> outputs_;
    bool ended_ = false;
};

}  // namespace tricoil::host

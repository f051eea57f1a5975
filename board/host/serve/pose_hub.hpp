// Passes poses from the tracker to the services. The tracker never waits for a service.
#pragma once

#include <array>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "board/page/page_levels.hpp"
#include "board/pose_text/served_pose.hpp"
#include "board/support/link_health.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_params.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::host {

/// Flags the last poses as stale when the tracker is silent.
class SilenceWatch {
public:
    static constexpr Microseconds kLimit{500'000};

    /// poses: new poses at `now`. If a sensor has had no pose for kLimit, appends its last pose once, flagged stale.
    void check(UtcTime now, std::vector<ServedPose>& poses) {
        for (const ServedPose& served : poses) {
            if (served.pose.sensor < sensors_.size()) {
                sensors_[served.pose.sensor] = {served, now};
            }
        }
        for (auto& sensor : sensors_) {
            if (sensor.newest && now - sensor.came > kLimit) {
                sensor.newest->pose.flags.set(tracking::PoseFlag::stale);
                poses.push_back(*sensor.newest);
                sensor.newest.reset();
            }
        }
    }

private:
    struct Sensor {
        std::optional<ServedPose> newest;  // none: no pose yet, or the silence was reported
        UtcTime came;
    };
    std::array<Sensor, tracking::kMaxSensors> sensors_;
};

/// Ring buffer. Each reader has its own position; a reader that is more than kCapacity poses behind misses the oldest.
class PoseHub final : public tracking::TrackerTap<double> {
public:
    static constexpr std::size_t kCapacity = 512;

    /// Position of a reader. Get it from cursor(), which gives the position of the next pose.
    struct Cursor {
        std::uint64_t next = 0;
        std::uint64_t missed = 0;  // poses overwritten before they were read
    };

    /// `notify` is called by the tracker's thread after each new pose. It must not wait.
    explicit PoseHub(std::function<void()> notify = {}) : ring_(kCapacity), notify_(std::move(notify)) {}

    [[nodiscard]] Cursor cursor() const;
    /// Appends new poses to `out`.
    void read(Cursor& cursor, std::vector<ServedPose>& out) const;

    /// Newest pose of each sensor, flagged stale if it is older than SilenceWatch::kLimit. For clients that connect later.
    [[nodiscard]] std::vector<ServedPose> newest() const;

    /// Newest health of the measurement and its link.
    void set_health(const LinkHealth& health);
    [[nodiscard]] LinkHealth health() const;

    /// See PageLevels.
    [[nodiscard]] Json newer_levels(std::uint64_t& seen) const;

    /// Number of tracked sensors; 0 before the start of the tracker.
    [[nodiscard]] int sensors() const;

    /// Of each sensor the direction to the half space that it never leaves, in the source frame. Empty if the trackers are not
    /// confined: then the half space follows the sensor.
    [[nodiscard]] std::vector<Vec3<double>> confinement() const;

private:
    void do_begin(const Settings& settings) override;
    void do_column(const MeasuredColumn<double>& column) override;
    void do_hemisphere(std::uint8_t sensor, const Vec3<double>& towards) override;
    void do_truth(std::uint8_t /*sensor*/, DeviceTime /*time*/, const TruePose& pose) override { truth_ = pose; }
    void do_pose(const tracking::PoseEstimate<double>& estimate) override;

    mutable std::mutex mutex_;
    std::vector<ServedPose> ring_;
    std::uint64_t count_ = 0;  // total number of poses
    std::array<std::optional<ServedPose>, tracking::kMaxSensors> newest_;
    std::optional<TruePose> truth_;  // of the next pose; only the tracker's thread uses it
    LinkHealth health_;
    web::PageLevels levels_;
    int sensors_ = 0;
    std::vector<Vec3<double>> confinement_;
    PoseClock clock_;
    ExpectedError expected_;
    std::function<void()> notify_;
};

}  // namespace tricoil::host

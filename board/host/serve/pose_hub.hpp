// Where the tracker's poses wait for those who send them on. The tracker never waits for anybody.
#pragma once

#include <array>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "board/pose_text/served_pose.hpp"
#include "board/support/wall_clock.hpp"
#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_params.hpp"
#include "hal/tracker_tap.hpp"

namespace tricoil::host {

/// A ring: each reader has its place in it, and one that falls behind by more than kCapacity poses misses the oldest.
class PoseHub final : public hal::TrackerTap<double> {
public:
    static constexpr std::size_t kCapacity = 512;

    /// A reader's place; starts at the poses to come.
    struct Cursor {
        std::uint64_t next = 0;
        std::uint64_t missed = 0;
    };

    /// `notify` is called, from the tracker's thread, whenever there is something new; it must not wait.
    explicit PoseHub(std::function<void()> notify = {}) : ring_(kCapacity), notify_(std::move(notify)) {}

    [[nodiscard]] Cursor cursor() const;
    /// Appends what is new to `out`.
    void read(Cursor& cursor, std::vector<ServedPose>& out) const;
    /// The same, after waiting for it: false if nothing came for `patience`, or the hub is closed.
    bool wait(Cursor& cursor, std::vector<ServedPose>& out, std::chrono::milliseconds patience) const;

    /// Wakes all who wait, for good.
    void close();
    [[nodiscard]] bool closed() const;

    /// The newest pose of each sensor, flagged stale if it has grown old: for one who comes later.
    [[nodiscard]] std::vector<ServedPose> newest() const;

    /// Sensors that the tracker follows; 0 until it has begun.
    [[nodiscard]] int sensors() const;

private:
    void do_begin(const Settings& settings) override;
    void do_column(const Column<double>& /*column*/) override {}
    void do_tick(std::uint8_t /*sensor*/, DeviceTime /*now*/) override {}
    void do_hemisphere(std::uint8_t /*sensor*/, const Vec3<double>& /*towards*/) override {}
    void do_pose(const tracking::PoseEstimate<double>& estimate) override;

    void read_locked(Cursor& cursor, std::vector<ServedPose>& out) const;

    mutable std::mutex mutex_;
    mutable std::condition_variable news_;
    std::vector<ServedPose> ring_;
    std::uint64_t count_ = 0;  // poses ever
    std::array<std::optional<ServedPose>, tracking::kMaxSensors> newest_;
    int sensors_ = 0;
    bool closed_ = false;
    WallClock clock_;
    std::function<void()> notify_;
};

}  // namespace tricoil::host

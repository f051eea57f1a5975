// Main loop of a Linux board: receives messages, switches coils, tracks columns, sends poses. A step uses no heap (except
// libusb transfers) and throws no exceptions.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "board/linux/device_session.hpp"
#include "board/linux/hemisphere_restorer.hpp"
#include "board/support/tool_tip.hpp"
#include "board/support/wiring_file.hpp"
#include "core/tracking/methods/any_tracker.hpp"
#include "core/tracking/tracker_tap.hpp"
#include "hal/coil_driver.hpp"
#include "hal/heartbeat.hpp"
#include "hal/sync_line.hpp"

namespace tricoil::linux_board {

/// Histogram of times with logarithmic buckets: quantiles of a run of any length in constant memory.
class LatencyHistogram {
public:
    void add(std::int64_t us) {
        const double value = std::max<double>(static_cast<double>(us), 1);
        const auto bucket = static_cast<std::size_t>(std::log2(value) * kPerOctave);
        ++counts_[std::min(bucket, kBuckets - 1)];
        ++total_;
        max_us_ = std::max(max_us_, us);
    }

    /// Upper end of the bucket of the quantile `share` (0 to 1), at most the longest time; 0 without times.
    [[nodiscard]] double quantile_us(double share) const {
        const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(total_)));
        std::uint64_t below = 0;
        for (std::size_t i = 0; i < kBuckets && total_ > 0; ++i) {
            below += counts_[i];
            if (below >= std::max<std::uint64_t>(wanted, 1)) {
                return std::min(std::exp2(static_cast<double>(i + 1) / kPerOctave), static_cast<double>(max_us_));
            }
        }
        return 0;
    }
    [[nodiscard]] std::int64_t max_us() const { return max_us_; }

private:
    static constexpr double kPerOctave = 8;          // a bucket is 9 % wide
    static constexpr std::size_t kBuckets = 26 * 8;  // up to one minute
    std::array<std::uint64_t, kBuckets> counts_{};
    std::uint64_t total_ = 0;
    std::int64_t max_us_ = 0;
};

/// GPIO lines of the host; null: not present. All must outlive the loop.
struct HostLines {
    hal::CoilDriver* coils = nullptr;
    hal::Heartbeat* heartbeat = nullptr;
    hal::SyncLine* sync = nullptr;
};

struct DeviceLoopParams {
    SessionParams session;
    tracking::MethodParams<double> method;
    double coupling_constant_m3 = 6.75e-3;
    std::optional<calibration::Calibration<double>> calibration;  // must suit the tracker
    Vec3<double> hemisphere = Vec3<double>::UnitX();              // at the first start; later only if session.confined
    host::ChannelWiring wiring;
    bool publish = false;
    host::ToolTips tips;  // of delivered and published poses
};

struct DeviceLoopCounters {
    std::uint64_t poses = 0;
    std::uint64_t valid_poses = 0;
    std::uint64_t excitations = 0;
    std::uint64_t sync_edges = 0;
    std::uint64_t lines_lost = 0;
    std::uint64_t unpublished = 0;
    std::uint64_t hemispheres_restored = 0;  // number of restored hemispheres
    std::uint64_t rejected_columns = 0;      // by the trackers of this host
};

class DeviceLoop {
public:
    using PoseSink = std::function<void(const tracking::PoseEstimate<double>&)>;

    /// `tap` receives inputs and outputs of the trackers, and must outlive the loop. `sink` receives every pose, of the tip if
    /// there is one.
    DeviceLoop(hal::MessagePort& port, HostLines lines, const DeviceLoopParams& params, tracking::TrackerTap<double>& tap,
               PoseSink sink);
    ~DeviceLoop();

    /// Processes arrived messages, or waits for them at most `longest_wait`, which is limited to 5 ms.
    void step(Microseconds longest_wait = Microseconds::max());

    /// AnyTracker::set_hemisphere, or the command of a tracker board. Without a session, takes effect at the next start. Does
    /// nothing for an unknown sensor.
    void set_hemisphere(std::size_t sensor, const Vec3<double>& towards);

    /// Switches the coils off and stops the front end. The destructor calls it too.
    void stop();

    [[nodiscard]] const DeviceSession& session() const { return session_; }
    [[nodiscard]] const DeviceLoopCounters& counters() const { return counters_; }
    [[nodiscard]] const LatencyHistogram& latency() const { return latency_; }
    /// Arrival of the newest column or pose that was not refused, or the device's start if later; empty: no start since stop().
    [[nodiscard]] std::optional<HostTime> newest() const { return newest_; }

private:
    void follow_phase();
    void take(const hal::ReceivedMessage& message);
    void begin();
    void track(const hal::ReceivedMessage& message);
    void take_pose(HostTime arrival);
    void answer(tracking::PoseEstimate<double>& estimate, bool valid, HostTime received);
    void deliver(const tracking::PoseEstimate<double>& pose, bool valid, HostTime received);
    void follow_sync();
    int take_edges();
    void beat();
    void next_state();
    void switch_off();
    void tick(HostTime host_now);

    hal::MessagePort& port_;
    HostLines lines_;
    DeviceLoopParams params_;
    tracking::TrackerTap<double>& tap_;
    PoseSink sink_;
    DeviceSession session_;
    std::array<std::optional<tracking::AnyTracker>, tracking::kMaxSensors> trackers_;
    std::array<host::ContinuedSequence, tracking::kMaxSensors> sequences_;              // of poses of new trackers too
    std::array<HemisphereRestorer, tracking::kMaxSensors> restorers_;                   // survive new trackers after a lost link
    std::array<HostTime, tracking::kMaxSensors> hemisphere_sent_{};                     // to a tracker board
    std::array<std::optional<Vec3<double>>, tracking::kMaxSensors> wanted_hemisphere_;  // set without a session
    std::array<std::uint8_t, protocol::kMaxFrameBytes> bytes_{};
    std::uint32_t state_sequence_ = 0;
    std::uint32_t pose_sequence_ = 0;
    std::optional<HostTime> newest_;
    std::optional<HostTime> column_time_;  // arrival of the newest column; empty: none since the session's start
    std::array<std::optional<HostTime>, tracking::kMaxSensors> sensor_times_;  // the same of each sensor
    bool is_tdm_ = true;
    bool was_running_ = false;
    LatencyHistogram latency_;
    DeviceLoopCounters counters_;
};

}  // namespace tricoil::linux_board

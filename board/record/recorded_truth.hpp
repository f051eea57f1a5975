// True poses of a recorded simulation.
#pragma once

#include <array>
#include <deque>
#include <functional>
#include <optional>
#include <string>

#include "board/record/recording.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

/// Reads events.csv once, forward. True poses end at one that is damaged or of another frame, and where the file was cut.
class RecordedTruth {
public:
    /// say: called with one line if the true poses end early; empty: a notice is printed. `recording` must outlive this object.
    explicit RecordedTruth(const Recording& recording, std::function<void(const std::string&)> say = {});

    /// True pose of a sensor at the time of a pose, source frame; nullopt: none was recorded. Ask in the order of the poses.
    /// Throws ReadError if the disk fails.
    std::optional<solver::RigidPose<double>> at(std::uint8_t sensor, DeviceTime time);

private:
    static constexpr Microseconds kDisorder{100'000};  // between the times of successive poses

    void read_until(DeviceTime time);
    /// Next true pose; nullopt at the end.
    std::optional<TrueSensor> read();
    void end(const std::string& why);

    const Recording& recording_;
    std::function<void(const std::string&)> say_;
    bool is_in_source_frame_ = false;
    std::optional<RecordLines> lines_;  // empty: no more true poses
    std::optional<DeviceTime> newest_;  // of those that were read
    std::string cut_;                   // where the file ended early, until a pose after it
    std::array<std::deque<TrueSensor>, tracking::kMaxSensors> next_;
};

}  // namespace tricoil::host

// A line on standard error when a sensor has no valid pose, and when it has one again.
#pragma once

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <optional>

#include "board/host/serve/service.hpp"
#include "board/pose_text/flag_names.hpp"
#include "board/support/limited_notice.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

/// Poses that are invalid for a shorter time than kLimit are not reported. A server that never had a pose is silent.
class ValidityLog final : public Service {
public:
    static constexpr std::chrono::seconds kLimit{1};

    void take(std::span<const ServedPose> poses) override {
        for (const ServedPose& served : poses) {
            if (served.pose.sensor < sensors_.size()) {
                follow(served.pose, sensors_[served.pose.sensor]);
            }
        }
    }

    void handle() override {
        for (std::size_t n = 0; n < sensors_.size(); ++n) {
            Sensor& sensor = sensors_[n];
            if (sensor.invalid_since && !sensor.is_told && Clock::now() - *sensor.invalid_since >= kLimit) {
                sensor.is_told = true;
                notice_.print(fmt::format("sensor {}: no valid pose: {}", n + 1, to_text(sensor.flags)));
            }
        }
    }

private:
    using Clock = std::chrono::steady_clock;
    struct Sensor {
        std::optional<Clock::time_point> invalid_since;
        tracking::PoseFlags flags;  // of the newest pose
        bool is_told = false;
    };

    void follow(const tracking::PoseEstimate<double>& pose, Sensor& sensor) {
        if (pose.valid()) {
            if (sensor.is_told) {
                notice_.print(fmt::format("sensor {}: valid poses again", pose.sensor + 1));
            }
            sensor = {};
            return;
        }
        sensor.flags = pose.flags;
        sensor.invalid_since = sensor.invalid_since.value_or(Clock::now());
    }

    std::array<Sensor, tracking::kMaxSensors> sensors_;
    LimitedNotice notice_{"serve"};
};

}  // namespace tricoil::host

// Expected error of a sensor, for everybody who sees its poses.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>

#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

/// RMS over the last second of the stated deviation (position, 3D) of valid poses: noise, motion and distortion.
class ExpectedError {
public:
    /// After this pose, in metres; NaN if the last second has no valid pose.
    double after(const tracking::PoseEstimate<double>& pose) {
        if (pose.sensor >= sensors_.size()) {
            return std::numeric_limits<double>::quiet_NaN();
        }
        Sensor& sensor = sensors_[pose.sensor];
        if (pose.valid()) {
            sensor.add(pose.time, pose.covariance.topLeftCorner<3, 3>().trace());
        }
        sensor.forget(pose.time);
        return sensor.rms_m();
    }

private:
    static constexpr Microseconds kSpan{1'000'000};

    struct Sensor {
        struct Entry {
            DeviceTime time;
            double variance_m2;
        };
        std::deque<Entry> entries;
        double sum_m2 = 0;

        void add(DeviceTime time, double variance_m2) {
            entries.push_back({time, variance_m2});
            sum_m2 += variance_m2;
        }
        /// A clock that began anew is earlier than the entries.
        void forget(DeviceTime now) {
            while (!entries.empty() && (now - entries.front().time > kSpan || now < entries.front().time)) {
                sum_m2 -= entries.front().variance_m2;
                entries.pop_front();
            }
            sum_m2 = entries.empty() ? 0 : sum_m2;
        }
        [[nodiscard]] double rms_m() const {
            const auto count = static_cast<double>(entries.size());
            return count > 0 ? std::sqrt(std::max(sum_m2, 0.0) / count) : std::numeric_limits<double>::quiet_NaN();
        }
    };

    std::array<Sensor, tracking::kMaxSensors> sensors_;
};

}  // namespace tricoil::host

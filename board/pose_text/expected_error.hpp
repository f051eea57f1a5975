// Expected error of a sensor, for everybody who sees its poses.
#pragma once

#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <utility>

#include "core/tracking/pose_estimate.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

/// RMS over the last second of the stated deviation (position, 3D) of valid poses: noise, motion and distortion.
class ExpectedError {
public:
    /// After this pose, in metres; NaN if the last second has no valid pose.
    double after(const tracking::PoseEstimate<double>& pose) {
        return after(pose, pose.covariance.topLeftCorner<3, 3>().trace());
    }
    /// The same of another length, given by its square.
    double after(const tracking::PoseEstimate<double>& pose, double square_m2) {
        constexpr Microseconds kSpan{1'000'000};
        constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
        if (pose.sensor >= sensors_.size()) {
            return kNone;
        }
        auto& recent = sensors_[pose.sensor];
        if (pose.valid()) {
            recent.emplace_back(pose.time, square_m2);
        }
        while (!recent.empty() && (pose.time - recent.front().first > kSpan || pose.time < recent.front().first)) {
            recent.pop_front();  // too old, or of a clock that has begun anew
        }
        double sum_m2 = 0;
        for (const auto& [time, square] : recent) {
            sum_m2 += square;
        }
        return recent.empty() ? kNone : std::sqrt(sum_m2 / static_cast<double>(recent.size()));
    }

private:
    std::array<std::deque<std::pair<DeviceTime, double>>, tracking::kMaxSensors> sensors_;
};

}  // namespace tricoil::host

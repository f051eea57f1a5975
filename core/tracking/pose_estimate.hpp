// Output of a tracker: pose, covariance, validity flags and diagnostics.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "core/base/time.hpp"
#include "core/error_model/error_budget.hpp"
#include "core/linear/quaternion.hpp"
#include "core/tracking/pose_flags.hpp"

namespace tricoil::tracking {

template <typename Scalar>
struct PoseEstimate {
    std::uint8_t sensor = 0;
    std::uint32_t sequence = 0;  // counts estimates
    DeviceTime time{};           // midpoint of the newest window used
    TrackerState state = TrackerState::searching;
    PoseFlags flags;
    Vec3<Scalar> position_m = Vec3<Scalar>::Zero();           // sensor in the source frame
    Quat<Scalar> q_source_sensor = Quat<Scalar>::Identity();  // v_source = q v_sensor
    Mat6<Scalar> covariance = Mat6<Scalar>::Zero();           // position (m), then small rotation (rad), source frame
    Scalar distortion_chi_square = 0;                         // 3 degrees of freedom; expectation 3 without distortion
    Scalar distortion_m = 0;                                  // position error (RMS) that the misfit suggests; 0: no misfit
    Scalar snr_db = 0;                                        // 20 log10(k / sigma)
    Mat3<Scalar> signal_matrix = Mat3<Scalar>::Zero();        // X as it was solved

    // Error budget at this pose; nullopt until the motion is known.
    std::optional<error_model::ErrorBudget<Scalar>> predicted_error;

    [[nodiscard]] bool valid() const {
        return !flags.has_any(kInvalidating) && std::isfinite(position_m.sum() + covariance.trace());
    }
};

/// Standard deviation of the position (3D root mean square).
template <typename Scalar>
Scalar deviation_m(const PoseEstimate<Scalar>& estimate) {
    return std::sqrt(estimate.covariance.template topLeftCorner<3, 3>().trace());
}

/// Makes position, distortion and SNR not a number and the deviations infinite, so that nothing looks like a measurement.
template <typename Scalar>
void clear_position(PoseEstimate<Scalar>& estimate) {
    constexpr Scalar kUnknown = std::numeric_limits<Scalar>::quiet_NaN();
    estimate.position_m.setConstant(kUnknown);
    estimate.covariance = Vec6<Scalar>::Constant(std::numeric_limits<Scalar>::infinity()).asDiagonal();
    estimate.distortion_m = kUnknown;
    estimate.snr_db = kUnknown;
}

/// clear_position() if a flag says so, or a part of the position is not a number.
template <typename Scalar>
void clear_unknown_position(PoseEstimate<Scalar>& estimate) {
    if (estimate.flags.has_any(kNoPosition) || !estimate.position_m.allFinite()) {
        clear_position(estimate);
    }
}

}  // namespace tricoil::tracking

// What the tracker delivers: a pose, how sure it is, and why not when it is not.
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/flag_set.hpp"
#include "core/base/time.hpp"
#include "core/error_model/error_budget.hpp"
#include "core/geometry/types.hpp"

namespace tricoil::tracking {

/// Reasons that travel with a pose (bit numbers).
enum class PoseFlag : std::uint8_t {
    saturated,           // a channel was at full scale or clipped: couplings are too small
    low_signal,          // signal to noise below the limit
    no_sensor,           // the couplings are no dipole's: crosstalk into open inputs, or a dead channel
    distorted,           // couplings differ from a dipole's by more than their noise: metal, motion between columns
    wrong_handedness,    // det X < 0: a coil is reversed or two are swapped
    stale,               // no usable measurement for a while; the pose is the last one known
    not_converged,       // the solver left its domain
    hemisphere_unknown,  // the sign of the position is a guess
    no_reference,        // no source current seen
    unconfirmed,         // the newest column contradicts the filter: an outlier, or the sensor jumped; the next columns tell
    inconsistent,        // innovations over a window are far larger than their covariance
    coasting,            // no new column since the last pose: predicted, and its covariance with it
};
using PoseFlags = FlagSet<PoseFlag>;

/// With one of these the pose must not be used. `distorted` (with a figure, distortion_chi_square) and `coasting` are warnings.
constexpr PoseFlags kInvalidating{PoseFlag::saturated,    PoseFlag::low_signal,         PoseFlag::no_sensor,
                                  PoseFlag::stale,        PoseFlag::wrong_handedness,   PoseFlag::not_converged,
                                  PoseFlag::no_reference, PoseFlag::hemisphere_unknown, PoseFlag::unconfirmed,
                                  PoseFlag::inconsistent};

enum class TrackerState : std::uint8_t { searching, tracking, lost };

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
    Scalar snr_db = 0;                                        // 20 log10(k / sigma)
    Mat3<Scalar> signal_matrix = Mat3<Scalar>::Zero();        // X as it was solved

    // The error to expect from motion and noise at this pose, term by term; nothing until the motion is known.
    std::optional<error_model::ErrorBudget<Scalar>> predicted_error;

    [[nodiscard]] bool valid() const { return !flags.has_any(kInvalidating); }
};

}  // namespace tricoil::tracking

// Pose flags and tracker states, common to all trackers.
#pragma once

#include <cstdint>

#include "core/base/flag_set.hpp"

namespace tricoil::tracking {

/// Flags of a pose (bit numbers).
enum class PoseFlag : std::uint8_t {
    saturated,           // a channel left its linear range, clipped, or has a large offset: couplings are too small
    low_signal,          // signal-to-noise ratio below the limit
    no_sensor,           // no dipole fits the couplings: crosstalk into open inputs, or a dead channel
    distorted,           // couplings differ from a dipole's, or have a quadrature, by more than noise and motion: metal
    wrong_handedness,    // det X < 0: a coil is reversed or two are swapped
    stale,               // no usable measurement for some time; the pose is the last known one
    not_converged,       // the solver did not converge
    hemisphere_unknown,  // the sign of the position is a guess
    no_reference,        // no source current
    unconfirmed,         // the newest columns contradict the prediction (outlier or jump), or too few were accepted since
    inconsistent,        // the innovations of the last columns are much larger than their covariance
    coasting,            // no new column since the last pose: pose and covariance are predicted
    uncertain,           // the standard deviation of the position at the last measurement is above its limit
    columns_missing,     // columns were lost or refused shortly before (ColumnsSinceGap)
    roll_undefined,      // sensor of one coil: the rotation about its axis, x of its frame, is arbitrary
};
using PoseFlags = FlagSet<PoseFlag>;

/// A pose with one of these flags must not be used. `distorted` (see distortion_chi_square), `coasting`, `columns_missing` and
/// `roll_undefined` are warnings.
constexpr PoseFlags kInvalidating{PoseFlag::saturated,    PoseFlag::low_signal,         PoseFlag::no_sensor,
                                  PoseFlag::stale,        PoseFlag::wrong_handedness,   PoseFlag::not_converged,
                                  PoseFlag::no_reference, PoseFlag::hemisphere_unknown, PoseFlag::unconfirmed,
                                  PoseFlag::inconsistent, PoseFlag::uncertain};

/// With one of these flags nothing was found that could be a position: a pose has none (clear_position()).
constexpr PoseFlags kNoPosition{PoseFlag::no_sensor, PoseFlag::no_reference};

/// Flags of a fault of the hardware or of the solution: such a pose is not continued by the next.
constexpr PoseFlags kFaultFlags{PoseFlag::saturated, PoseFlag::no_sensor, PoseFlag::wrong_handedness, PoseFlag::not_converged,
                                PoseFlag::no_reference};

constexpr PoseFlags kAllPoseFlags =
    kInvalidating | PoseFlags{PoseFlag::distorted, PoseFlag::coasting, PoseFlag::columns_missing, PoseFlag::roll_undefined};

enum class TrackerState : std::uint8_t { searching, tracking, lost };

}  // namespace tricoil::tracking

// Why a pose is not to be trusted, and what a tracker is doing: the same words in every arithmetic.
#pragma once

#include <cstdint>

#include "core/base/flag_set.hpp"

namespace tricoil::tracking {

/// Reasons that travel with a pose (bit numbers).
enum class PoseFlag : std::uint8_t {
    saturated,           // a channel was at full scale or clipped, so that couplings are too small, or an offset drives it there
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

}  // namespace tricoil::tracking

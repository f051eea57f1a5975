// Removal of whole turns from large angle errors, as in the paper.
#pragma once

#include <cmath>
#include <numbers>

namespace tricoil::error_model {

/// Remainder of the angle after division by a whole turn: in (-2 pi, 2 pi), with the sign of the angle. Sections 3.3 and 4
/// subtract a turn only after an error exceeds 2 pi. (geometry::wrap_turns uses the other convention, the nearest turn.)
template <typename Scalar>
Scalar without_whole_turns(Scalar angle_rad) {
    return std::fmod(angle_rad, 2 * std::numbers::pi_v<Scalar>);
}

}  // namespace tricoil::error_model

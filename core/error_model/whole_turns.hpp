// The paper's treatment of large angle errors: whole turns are taken off.
#pragma once

#include <cmath>
#include <numbers>

namespace tricoil::error_model {

/// `angle` less whole turns towards zero, hence in (-2 pi, 2 pi) with its own sign: sections 3.3 and 4 subtract a rotation only
/// once an error exceeds 2 pi. (geometry::wrap_turns is the other convention, nearest turn.)
template <typename Scalar>
Scalar without_whole_turns(Scalar angle_rad) {
    return std::fmod(angle_rad, 2 * std::numbers::pi_v<Scalar>);
}

}  // namespace tricoil::error_model

// Directions of half spaces.
#pragma once

#include <cmath>

#include "core/linear/matrix.hpp"

namespace tricoil::tracking {

/// True for the direction of a half space, of any length whose square is a number, and for zero: unknown.
template <typename Scalar>
bool is_hemisphere(const Vec3<Scalar>& towards) {
    const Scalar square = towards.squaredNorm();
    return towards.isZero(0) || (std::isfinite(square) && square > 0);
}

}  // namespace tricoil::tracking

// Sign of a quaternion: q and -q are the same attitude.
#pragma once

#include "core/linear/matrix.hpp"

namespace tricoil::geometry {

/// q or -q, whichever is nearer to `reference`.
template <typename Scalar>
Quat<Scalar> with_sign_of(const Quat<Scalar>& q, const Quat<Scalar>& reference) {
    return q.dot(reference) < 0 ? Quat<Scalar>(-q.coeffs()) : q;
}

}  // namespace tricoil::geometry

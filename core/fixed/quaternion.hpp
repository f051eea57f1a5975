// Attitude quaternion in integers.
#pragma once

#include "core/fixed/functions.hpp"
#include "core/fixed/matrix.hpp"

namespace tricoil::fixed {

struct Quaternion {
    Unit w = 1;
    Unit x = 0;
    Unit y = 0;
    Unit z = 0;
    friend constexpr bool operator==(const Quaternion&, const Quaternion&) = default;
};

/// q_source_sensor (v_source = q v_sensor) of O, a rotation. w is not negative; if w is zero, the largest component is not
/// negative. Error below 4e-9 for a rotation; undefined numbers for any other matrix.
Quaternion attitude_quaternion(const Mat3<Unit>& o);

/// q or -q, which is the same attitude: the one closer to `last`.
Quaternion with_sign_of(const Quaternion& q, const Quaternion& last);

}  // namespace tricoil::fixed

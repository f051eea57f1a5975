// Which side of the source a position is on, in integers: what tracking::Hemisphere asks.
#pragma once

#include "core/base/time.hpp"
#include "core/fixed/direct.hpp"

namespace tricoil::fixed {

/// Twin of tracking::Sides<Scalar>, for positions that saturate at 8 m.
struct Sides {
    static bool are_opposite(const Vec3<Metres>& a, const Vec3<Metres>& b);
    /// Within 2^-26 m^2 of the real numbers' answer.
    static bool is_mirror_excluded(const Vec3<Metres>& near, const Vec3<Metres>& last, Microseconds unseen);
};

}  // namespace tricoil::fixed

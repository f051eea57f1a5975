// Comparisons of positions for tracking::Hemisphere, in integers.
#pragma once

#include "core/base/time.hpp"
#include "core/fixed/direct.hpp"

namespace tricoil::fixed {

/// Twin of tracking::Sides<Scalar>, for positions that saturate at 8 m.
struct Sides {
    static bool are_opposite(const Vec3<Metres>& a, const Vec3<Metres>& b);
    /// Same result as with real numbers, except within 2^-26 m^2 of the limit.
    static bool is_mirror_excluded(const Vec3<Metres>& near, const Vec3<Metres>& last, Microseconds unseen);
};

}  // namespace tricoil::fixed

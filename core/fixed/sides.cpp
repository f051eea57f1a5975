#include "core/fixed/sides.hpp"

#include <algorithm>

#include "core/tracking/state/hemisphere.hpp"

namespace tricoil::fixed {
namespace {

/// Squares of metres; no range is above 8 m.
using SquareMetres = Fixed<25>;

SquareMetres square_of(const Vec3<Metres>& v) { return dot<SquareMetres::kFractionBits>(v, v); }

Scaled scaled(SquareMetres value) { return normalise(value.raw(), -SquareMetres::kFractionBits); }

/// Squared distance that a hand can move, 2^-25 m^2. Times are limited to 10 s, in which it can reach any position.
std::int64_t reach_squared(Microseconds unseen) {
    constexpr auto kStepsPerSecond = static_cast<std::int64_t>(tracking::kMaxUnseenSpeed_m_s * (1 << 20));  // of 2^-20 m
    constexpr std::int64_t kLongest_us = 10'000'000;
    const std::int64_t steps = std::min<std::int64_t>(unseen.count(), kLongest_us) * kStepsPerSecond / 1'000'000;  // below 2^25
    return (steps * steps) >> 15;
}

}  // namespace

bool Sides::are_opposite(const Vec3<Metres>& a, const Vec3<Metres>& b) { return dot<25>(a, b).raw() < 0; }

/// Uses (near +- last)^2 = near^2 +- 2 near . last + last^2, because the sum of two positions may overflow.
bool Sides::is_mirror_excluded(const Vec3<Metres>& near, const Vec3<Metres>& last, Microseconds unseen) {
    const SquareMetres both = dot<SquareMetres::kFractionBits>(near, last);
    const SquareMetres near_squared = square_of(near);
    const SquareMetres last_squared = square_of(last);
    const Scaled quarter = multiply(normalise(1, -2), multiply(scaled(near_squared), scaled(last_squared)));
    const std::int64_t squares = std::int64_t{near_squared.raw()} + last_squared.raw();  // 2^-25 m^2
    const std::int64_t twice = 2 * std::int64_t{both.raw()};
    const std::int64_t reach = reach_squared(unseen);
    const bool is_beside = twice > 0 && is_less(quarter, multiply(scaled(both), scaled(both)));
    return (is_beside || squares - twice <= reach) && squares + twice > reach;
}

}  // namespace tricoil::fixed

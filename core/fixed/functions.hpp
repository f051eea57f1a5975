// Elementary functions in integers. Stated errors are worst cases over the whole domain; tests/fixed checks them.
#pragma once

#include <cstdint>

#include "core/fixed/fixed.hpp"

namespace tricoil::fixed {

/// Number with magnitude below two: sine, entry of a rotation matrix or unit vector.
using Unit = Fixed<30>;

/// Angle in units of 2^-32 turn. It wraps like an angle.
struct Angle {
    std::uint32_t turns = 0;
    friend constexpr bool operator==(Angle, Angle) = default;
};

struct SineCosine {
    Unit sine;
    Unit cosine;
};

/// Error of each below 4e-9.
SineCosine sine_cosine(Angle angle);

/// floor(sqrt(value)), exact.
std::uint32_t square_root(std::uint64_t value);

/// floor(cbrt(value)), exact; at most 2,642,245.
std::uint32_t cube_root(std::uint64_t value);

}  // namespace tricoil::fixed

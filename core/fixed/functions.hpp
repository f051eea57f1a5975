// Elementary functions in integers. Stated errors are worst cases over the whole domain, held by tests/fixed.
#pragma once

#include <cstdint>

#include "core/fixed/fixed.hpp"

namespace tricoil::fixed {

/// Numbers that stay below two in size: sines, entries of rotations, unit vectors.
using Unit = Fixed<30>;

/// An angle as a share of a turn, 2^32 to a turn: it wraps as angles do.
struct Angle {
    std::uint32_t turns = 0;
    friend constexpr bool operator==(Angle, Angle) = default;
};

struct SineCosine {
    Unit sine;
    Unit cosine;
};

/// Error of either below 4e-9.
SineCosine sine_cosine(Angle angle);

/// floor(sqrt(value)), exact.
std::uint32_t square_root(std::uint64_t value);

/// floor(cbrt(value)), exact; at most 2^21.
std::uint32_t cube_root(std::uint64_t value);

}  // namespace tricoil::fixed

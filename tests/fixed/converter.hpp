// Couplings with the resolution of a 24-bit converter.
#pragma once

#include <cmath>

#include "core/fixed/from_double.hpp"

namespace tricoil::fixed {

/// One code is 2^-13 coupling units.
constexpr int kCodeExponent = -13;

/// X for C = 1 in whole codes: up to 2.4 million codes at 0.15 m, 4,700 at 1.2 m.
inline BlockMatrix as_codes(const Mat3<double>& x) {
    BlockMatrix codes;
    codes.exponent = kCodeExponent;
    for (Index i = 0; i < 9; ++i) {
        codes.mantissa(i) = static_cast<std::int32_t>(std::lround(std::ldexp(x(i), -kCodeExponent)));
    }
    return codes;
}

/// The same couplings in double.
inline Mat3<double> as_double(const BlockMatrix& x) { return std::ldexp(1.0, x.exponent) * x.mantissa.cast<double>(); }

template <typename Derived>
auto to_double(const Dense<Derived>& m) {
    return m.unaryExpr([](auto entry) { return entry.to_double(); });
}

}  // namespace tricoil::fixed

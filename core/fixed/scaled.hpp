// Numbers with mantissa and exponent. Stated errors are worst cases; tests/fixed checks them.
#pragma once

#include <cstdint>

#include "core/fixed/fixed.hpp"

namespace tricoil::fixed {

/// Exponents are limited to this magnitude. Signals are far below it, and sums of a few exponents do not overflow an int.
constexpr int kMaxExponent = 1 << 24;

constexpr int bounded_exponent(int exponent) {
    return exponent > kMaxExponent ? kMaxExponent : (exponent < -kMaxExponent ? -kMaxExponent : exponent);
}

/// Number mantissa * 2^exponent. Normalised: 2^30 <= |mantissa| < 2^31, or zero. Exponents are limited to kMaxExponent.
struct Scaled {
    std::int32_t mantissa = 0;
    int exponent = 0;
    friend constexpr bool operator==(Scaled, Scaled) = default;
};

/// value 2^exponent, normalised; rounds once, relative error below 2^-31.
Scaled normalise(std::int64_t value, int exponent);
/// a b for normalised a and b; relative error below 2^-30.
Scaled multiply(Scaled a, Scaled b);
/// a + b for normalised a and b; error below 2^-29 of the larger.
Scaled add(Scaled a, Scaled b);
/// a / b for normalised b; relative error below 2^-29. Division by zero: the largest number, with the sign of a; 0 / 0 is 0.
Scaled divide(Scaled a, Scaled b);
/// Square root of a normalised number; zero for a negative one; relative error below 2^-29.
Scaled square_root(Scaled value);
/// a < b for normalised a and b.
bool is_less(Scaled a, Scaled b);
/// Cube root of a normalised number >= 0; relative error below 1e-8.
Scaled cube_root(Scaled value);

/// Conversion to format F; saturates or rounds to nearest.
template <int F>
Fixed<F> to_fixed(Scaled value) {
    const int shift = -(bounded_exponent(value.exponent) + F);  // raw = mantissa 2^(exponent + F)
    if (shift >= 63) {
        return {};
    }
    if (shift >= 0) {
        return Fixed<F>::from_raw(saturate(shift_right_rounded(value.mantissa, shift)));
    }
    const int left = -shift > 32 ? 32 : -shift;
    return Fixed<F>::from_raw(saturate(static_cast<std::int64_t>(value.mantissa) * (std::int64_t{1} << left)));
}

}  // namespace tricoil::fixed

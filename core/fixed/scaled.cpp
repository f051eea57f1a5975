#include "core/fixed/scaled.hpp"

#include <limits>

#include "core/fixed/functions.hpp"
#include "core/fixed/sizes.hpp"

namespace tricoil::fixed {

Scaled normalise(std::int64_t value, int exponent) {
    if (value == 0) {
        return {};
    }
    const bool negative = value < 0;
    const std::uint64_t size = size_of(value);
    const int shift = excess_bits(size, 31);
    std::uint64_t mantissa = shift <= 0 ? size << -shift : (size >> shift) + ((size >> (shift - 1)) & 1U);
    int shifted = bounded_exponent(exponent) + shift;
    if (mantissa >> 31 != 0) {  // rounded up to the next power of two
        mantissa >>= 1;
        ++shifted;
    }
    const auto whole = static_cast<std::int32_t>(mantissa);
    return {negative ? -whole : whole, shifted};
}

Scaled multiply(Scaled a, Scaled b) {
    return normalise(std::int64_t{a.mantissa} * b.mantissa, bounded_exponent(a.exponent) + bounded_exponent(b.exponent));
}

Scaled add(Scaled a, Scaled b) {
    if (a.mantissa == 0 || b.mantissa == 0) {
        return a.mantissa == 0 ? b : a;
    }
    const bool a_leads = a.exponent >= b.exponent;
    const Scaled larger = a_leads ? a : b;
    const Scaled smaller = a_leads ? b : a;
    const int apart = bounded_exponent(larger.exponent) - bounded_exponent(smaller.exponent);
    // Both mantissas are shifted left by 30 bits: magnitudes at most 2^61, sum at most 2^62.
    const std::int64_t high = std::int64_t{larger.mantissa} * (std::int64_t{1} << 30);
    const std::int64_t low = apart > 62 ? 0 : (std::int64_t{smaller.mantissa} * (std::int64_t{1} << 30)) >> apart;
    return normalise(high + low, bounded_exponent(larger.exponent) - 30);
}

Scaled square_root(Scaled value) {
    if (value.mantissa <= 0) {
        return {};
    }
    const int exponent = bounded_exponent(value.exponent);
    const int odd = exponent & 1;
    const std::uint64_t wide = static_cast<std::uint64_t>(value.mantissa) << (32 + odd);  // up to 2^64: a root of 31 to 32 bits
    return normalise(square_root(wide), (exponent - odd) / 2 - 16);
}

bool is_less(Scaled a, Scaled b) {
    const auto sign = [](std::int32_t mantissa) { return mantissa > 0 ? 1 : (mantissa < 0 ? -1 : 0); };
    if (sign(a.mantissa) != sign(b.mantissa) || a.exponent == b.exponent || a.mantissa == 0) {
        return a.mantissa < b.mantissa;
    }
    return (a.exponent < b.exponent) == (a.mantissa > 0);
}

Scaled divide(Scaled a, Scaled b) {
    if (b.mantissa == 0) {
        const std::int32_t most = std::numeric_limits<std::int32_t>::max();
        return a.mantissa == 0 ? Scaled{} : Scaled{a.mantissa > 0 ? most : -most, kMaxExponent};
    }
    const std::int64_t quotient = std::int64_t{a.mantissa} * (std::int64_t{1} << 31) / b.mantissa;
    return normalise(quotient, bounded_exponent(a.exponent) - bounded_exponent(b.exponent) - 31);
}

Scaled cube_root(Scaled value) {
    if (value.mantissa <= 0) {
        return {};
    }
    // As m 2^(3 n) with m of up to 63 bits, whose root has 21 bits. Then one Newton step in integers, r -= (r^3 - m) / (3 r^2).
    const int exponent = bounded_exponent(value.exponent);
    int shift = 30;
    while ((exponent - shift) % 3 != 0) {
        ++shift;
    }
    const std::uint64_t m = static_cast<std::uint64_t>(value.mantissa) << shift;
    const std::uint64_t root = cube_root(m);
    const auto rest = static_cast<std::int64_t>(m - root * root * root);  // below 3 r^2 + 3 r + 1, hence 2^44
    // Adds ten bits: root + rest / (3 root^2 + 3 rest / (3 root)) has an error below 2^-22 of the last of the 21 bits.
    const auto slope = static_cast<std::int64_t>(3 * root * root + 3 * rest / static_cast<std::int64_t>(3 * root));
    const std::int64_t fraction = rest * (1 << 10) / slope;
    return normalise(static_cast<std::int64_t>(root) * (1 << 10) + fraction, (exponent - shift) / 3 - 10);
}

}  // namespace tricoil::fixed

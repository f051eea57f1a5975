// Fixed-point number on a 32-bit integer with the binary point as template parameter, for processors without floating-point unit.
#pragma once

#include <compare>
#include <cstdint>
#include <limits>

namespace tricoil::fixed {

/// Clamps to the range of a 32-bit integer.
constexpr std::int32_t saturate(std::int64_t value) {
    constexpr std::int64_t kLargest = std::numeric_limits<std::int32_t>::max();
    constexpr std::int64_t kSmallest = std::numeric_limits<std::int32_t>::min();
    return static_cast<std::int32_t>(value > kLargest ? kLargest : (value < kSmallest ? kSmallest : value));
}

/// value / 2^bits, rounded to nearest, halves upwards. 0 <= bits <= 63; defined for every value.
constexpr std::int64_t shift_right_rounded(std::int64_t value, int bits) {
    return bits == 0 ? value : (value >> bits) + ((value >> (bits - 1)) & 1);
}

/// raw / 2^F: F fraction bits, 31 - F integer bits, one sign bit. All operations saturate, none wraps. Sums are exact unless they
/// saturate. Products are accurate to half a unit of the last place, 2^-(F+1).
template <int F>
class Fixed {
    static_assert(F >= 0 && F <= 31);

public:
    static constexpr int kFractionBits = F;

    constexpr Fixed() = default;
    /// Conversion from integers, for matrices of zeros and ones.
    constexpr Fixed(int whole)
        : raw_(saturate(static_cast<std::int64_t>(whole) * (std::int64_t{1} << F))) {}  // NOLINT: implicit by intention

    static constexpr Fixed from_raw(std::int32_t raw) {
        Fixed value;
        value.raw_ = raw;
        return value;
    }
    /// Nearest value; NaN becomes zero. For constants and tests only: processors without floating-point unit avoid double.
    static constexpr Fixed from(double value) {
        const double scaled = value * static_cast<double>(std::int64_t{1} << F);
        if (!(scaled < 2147483647.0)) {
            return from_raw(value != value ? 0 : std::numeric_limits<std::int32_t>::max());
        }
        if (scaled <= -2147483648.0) {
            return from_raw(std::numeric_limits<std::int32_t>::min());
        }
        return from_raw(saturate(static_cast<std::int64_t>(scaled < 0 ? scaled - 0.5 : scaled + 0.5)));
    }
    /// Converts from another format; rounds or saturates.
    template <int G>
    static constexpr Fixed from(Fixed<G> other) {
        if constexpr (G >= F) {
            return from_raw(saturate(shift_right_rounded(other.raw(), G - F)));
        } else {
            return from_raw(saturate(static_cast<std::int64_t>(other.raw()) * (std::int64_t{1} << (F - G))));
        }
    }

    [[nodiscard]] constexpr std::int32_t raw() const { return raw_; }
    [[nodiscard]] constexpr double to_double() const {
        return static_cast<double>(raw_) / static_cast<double>(std::int64_t{1} << F);
    }

    static constexpr Fixed largest() { return from_raw(std::numeric_limits<std::int32_t>::max()); }
    static constexpr Fixed smallest() { return from_raw(std::numeric_limits<std::int32_t>::min()); }

    friend constexpr Fixed operator+(Fixed a, Fixed b) { return from_raw(saturate(std::int64_t{a.raw_} + b.raw_)); }
    friend constexpr Fixed operator-(Fixed a, Fixed b) { return from_raw(saturate(std::int64_t{a.raw_} - b.raw_)); }
    friend constexpr Fixed operator-(Fixed a) { return from_raw(saturate(-std::int64_t{a.raw_})); }
    friend constexpr Fixed operator*(Fixed a, Fixed b) {
        return from_raw(saturate(shift_right_rounded(std::int64_t{a.raw_} * b.raw_, F)));
    }
    constexpr Fixed& operator+=(Fixed b) { return *this = *this + b; }
    constexpr Fixed& operator-=(Fixed b) { return *this = *this - b; }
    constexpr Fixed& operator*=(Fixed b) { return *this = *this * b; }

    friend constexpr bool operator==(Fixed, Fixed) = default;
    friend constexpr std::strong_ordering operator<=>(Fixed a, Fixed b) { return a.raw_ <=> b.raw_; }

private:
    std::int32_t raw_ = 0;
};

template <int F>
constexpr Fixed<F> abs(Fixed<F> value) {
    return value.raw() < 0 ? -value : value;
}

/// Product a b in format Out, rounded once.
template <int Out, int A, int B>
constexpr Fixed<Out> product(Fixed<A> a, Fixed<B> b) {
    static_assert(A + B >= Out);
    return Fixed<Out>::from_raw(saturate(shift_right_rounded(std::int64_t{a.raw()} * b.raw(), A + B - Out)));
}

}  // namespace tricoil::fixed

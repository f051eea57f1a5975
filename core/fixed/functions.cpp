#include "core/fixed/functions.hpp"

#include <array>
#include <bit>

#include "core/fixed/sizes.hpp"

namespace tricoil::fixed {
namespace {

constexpr std::uint32_t kEighth = 1U << 29;
constexpr std::uint32_t kQuarter = 1U << 30;
constexpr std::int64_t kPiQ29 = 1'686'629'713;  // pi 2^29

/// c[0] + c[1] x + c[2] x^2 + ..., all in Q30 with |x| <= 1; one rounding of half a unit per term.
template <std::size_t N>
std::int64_t polynomial(const std::array<std::int32_t, N>& c, std::int64_t x) {
    std::int64_t sum = c[N - 1];
    for (std::size_t n = N - 1; n-- > 0;) {
        sum = c[n] + shift_right_rounded(sum * x, 30);
    }
    return sum;
}

constexpr std::int32_t q30(double value) { return Unit::from(value).raw(); }

// Taylor series up to an eighth of a turn. The first omitted term is below 1e-11.
constexpr std::array<std::int32_t, 6> kSine{q30(1.0),         q30(-1.0 / 6),     q30(1.0 / 120),
                                            q30(-1.0 / 5040), q30(1.0 / 362880), q30(-1.0 / 39916800)};
constexpr std::array<std::int32_t, 7> kCosine{q30(1.0),         q30(-0.5),           q30(1.0 / 24),       q30(-1.0 / 720),
                                              q30(1.0 / 40320), q30(-1.0 / 3628800), q30(1.0 / 479001600)};
/// For -pi/4 <= x <= pi/4 in Q30.
SineCosine near_zero(std::int64_t x) {
    const std::int64_t squared = shift_right_rounded(x * x, 30);
    const std::int64_t sine = shift_right_rounded(polynomial(kSine, squared) * x, 30);
    return {Unit::from_raw(saturate(sine)), Unit::from_raw(saturate(polynomial(kCosine, squared)))};
}

/// floor(sqrt(value)) for value >= 2^30. Newton's iteration from above, started from 1.5 * 2^15: its relative errors are below
/// 8.4 %, 0.33 % and 6e-6. The last is 0.4 of a unit, and each division may lose one.
std::uint32_t root_of_upper(std::uint32_t value) {
    constexpr std::uint32_t kStart = 3U << 14;
    std::uint32_t root = kStart / 2 + value / (2 * kStart) + 1;
    root = (root + value / root) / 2 + 1;
    root = (root + value / root) / 2;
    return root - (std::uint64_t{root} * root > value ? 1 : 0);
}

/// floor(cbrt(value)) or one more, for 2^28 <= value < 2^31: Newton's iteration from above.
std::uint32_t cube_root_of_upper(std::uint32_t value) {
    std::uint32_t root = 1000;  // between the roots of the limits, 645 and 1290
    for (int n = 0; n < 4; ++n) {
        root = (2 * root + value / (root * root)) / 3 + 1;
    }
    return root;
}

}  // namespace

SineCosine sine_cosine(Angle angle) {
    const std::uint32_t quadrant = (angle.turns + kEighth) / kQuarter;  // 0 to 3, and 0 again after the wrap
    const auto rest = static_cast<std::int32_t>(angle.turns - quadrant * kQuarter);
    // 2^-32 turn is pi / 2 units of Q30 radians: multiply by pi in Q29 and divide by 2^30.
    const SineCosine near = near_zero(shift_right_rounded(rest * kPiQ29, 30));
    switch (quadrant & 3U) {
        case 0:
            return near;
        case 1:
            return {near.cosine, -near.sine};
        case 2:
            return {-near.sine, -near.cosine};
        default:
            return {-near.cosine, near.sine};
    }
}

std::uint32_t square_root(std::uint64_t value) {
    if (value == 0) {
        return 0;
    }
    // Zimmermann's "Karatsuba Square Root" (1999) with two digits of 16 bits: the root of the upper half, then one division.
    const int shift = std::countl_zero(value) / 2;
    const std::uint64_t shifted = value << (2 * shift);
    const std::uint32_t upper = root_of_upper(static_cast<std::uint32_t>(shifted >> 32));
    const std::uint32_t upper_rest = static_cast<std::uint32_t>(shifted >> 32) - upper * upper;  // at most 2 upper
    const auto lower = static_cast<std::uint32_t>(shifted);
    const std::uint32_t dividend = upper_rest << 15 | lower >> 17;  // half of the rest with one more digit
    const std::uint32_t digit = dividend / upper;
    const std::uint64_t rest = std::uint64_t{dividend - digit * upper} << 17 | (lower & 0x1FFFFU);
    const std::uint32_t excess = rest < std::uint64_t{digit} * digit ? 1 : 0;
    return static_cast<std::uint32_t>(((std::uint64_t{upper} << 16) + digit - excess) >> shift);
}

std::uint32_t cube_root(std::uint64_t value) {
    if (value == 0) {
        return 0;
    }
    // Shifted to 62 to 64 bits. Two Newton steps from the root of the upper half give 22 bits or one unit more.
    const int shift = std::countl_zero(value) / 3;
    const std::uint64_t shifted = value << (3 * shift);
    std::uint32_t root = (cube_root_of_upper(static_cast<std::uint32_t>(shifted >> 33)) + 1) << 11;
    for (int n = 0; n < 2; ++n) {
        root = (2 * root + static_cast<std::uint32_t>(shifted / (std::uint64_t{root} * root))) / 3;
    }
    root -= std::uint64_t{root} * root * root > shifted ? 1 : 0;
    return root >> shift;
}

}  // namespace tricoil::fixed

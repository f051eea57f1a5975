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
    // Bit by bit from the highest possible one: no division and no initial guess.
    std::uint64_t bit = std::uint64_t{1} << ((63 - std::countl_zero(value)) & ~1);
    std::uint64_t rest = value;
    std::uint64_t root = 0;
    for (; bit != 0; bit >>= 2) {
        const std::uint64_t trial = root + bit;
        root >>= 1;
        if (rest >= trial) {
            rest -= trial;
            root += bit;
        }
    }
    return static_cast<std::uint32_t>(root);
}

std::uint32_t cube_root(std::uint64_t value) {
    std::uint64_t root = 0;
    for (int shift = 63; shift >= 0; shift -= 3) {
        root *= 2;
        const std::uint64_t step = 3 * root * (root + 1) + 1;  // (root + 1)^3 - root^3
        if ((value >> shift) >= step) {
            value -= step << shift;
            ++root;
        }
    }
    return static_cast<std::uint32_t>(root);
}

}  // namespace tricoil::fixed

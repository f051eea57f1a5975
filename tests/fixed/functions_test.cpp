#include "core/fixed/functions.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/fixed/scaled.hpp"

namespace tricoil::fixed {
namespace {

constexpr long double kPi = std::numbers::pi_v<long double>;

long double radians_of(Angle angle) { return static_cast<std::int32_t>(angle.turns) * (2 * kPi / 4294967296.0L); }

TEST(FixedFunctions, SineAndCosineOverTheWholeTurn) {
    long double worst = 0;
    for (std::uint64_t turns = 0; turns < (std::uint64_t{1} << 32); turns += 4099) {
        const Angle angle{static_cast<std::uint32_t>(turns)};
        const auto [sine, cosine] = sine_cosine(angle);
        worst = std::max({worst, std::abs(sine.to_double() - std::sin(radians_of(angle))),
                          std::abs(cosine.to_double() - std::cos(radians_of(angle)))});
    }
    EXPECT_LT(worst, 4e-9L);
    EXPECT_GT(worst, 5e-10L);
    EXPECT_EQ(sine_cosine({0}).sine, Unit(0));
    EXPECT_EQ(sine_cosine({0}).cosine, Unit(1));
    EXPECT_EQ(sine_cosine({1U << 30}).sine, Unit(1));
    EXPECT_EQ(sine_cosine({1U << 31}).cosine, Unit(-1));
}

TEST(FixedFunctions, RootsAreExact) {
    std::mt19937_64 random(3);
    const auto check = [](std::uint64_t value) {
        __extension__ using Exact = unsigned __int128;
        const Exact square = square_root(value);
        ASSERT_TRUE(square * square <= value && (square + 1) * (square + 1) > value) << value;
        const Exact cube = cube_root(value);
        ASSERT_TRUE(cube * cube * cube <= value && (cube + 1) * (cube + 1) * (cube + 1) > value) << value;
    };
    for (int n = 0; n < 300'000; ++n) {
        check(random() >> (random() % 64));
    }
    for (std::uint64_t n = 0; n < 2000; ++n) {
        check(n);
        check(~n);
        check(n * n * n);
        check((n << 21) * (n << 21));
    }
}

TEST(FixedFunctions, ScaledNumbers) {
    std::mt19937_64 random(4);
    for (int n = 0; n < 300'000; ++n) {
        const auto value = static_cast<std::int64_t>(random()) >> (random() % 64);
        const int exponent = static_cast<int>(random() % 41) - 20;
        const Scaled a = normalise(value, exponent);
        const auto exact = std::ldexp(static_cast<long double>(value), exponent);
        const auto got = std::ldexp(static_cast<long double>(a.mantissa), a.exponent);
        ASSERT_LE(std::abs(got - exact), std::abs(exact) * 0x1p-31L);
        if (a.mantissa == 0) {
            ASSERT_EQ(value, 0);
            continue;
        }
        ASSERT_GE(std::abs(std::int64_t{a.mantissa}), std::int64_t{1} << 30);
        if (a.mantissa > 0) {
            const Scaled root = cube_root(a);
            const auto root_exact = std::cbrt(got);
            ASSERT_LE(std::abs(std::ldexp(static_cast<long double>(root.mantissa), root.exponent) - root_exact),
                      root_exact * 1e-8L);
        }
        const Scaled b = normalise(static_cast<std::int64_t>(random() | 1), 3);
        const Scaled q = divide(a, b);
        const auto q_exact = got / std::ldexp(static_cast<long double>(b.mantissa), b.exponent);
        ASSERT_LE(std::abs(std::ldexp(static_cast<long double>(q.mantissa), q.exponent) - q_exact), std::abs(q_exact) * 0x1p-29L);
    }
    EXPECT_EQ(normalise(0, 5), (Scaled{0, 0}));
    EXPECT_EQ(cube_root(Scaled{0, 0}), (Scaled{0, 0}));
    EXPECT_EQ(cube_root(normalise(-8, 0)), (Scaled{0, 0}));
    EXPECT_EQ(to_fixed<28>(normalise(1, 40)), Fixed<28>::largest());
    EXPECT_EQ(to_fixed<28>(normalise(-1, 40)), Fixed<28>::smallest());
    EXPECT_EQ(to_fixed<28>(normalise(1, -90)), Fixed<28>(0));
    EXPECT_EQ(to_fixed<28>(normalise(3, -1)), Fixed<28>::from(1.5));
}

}  // namespace
}  // namespace tricoil::fixed

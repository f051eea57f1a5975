// All functions of core/fixed at the ends of their arguments' ranges: documented results, no undefined behaviour.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "core/fixed/demodulator.hpp"
#include "core/fixed/previous_measurement.hpp"
#include "tests/fixed/converter.hpp"

namespace tricoil::fixed {
namespace {

__extension__ using Wide = __int128;

constexpr std::int32_t kMax = std::numeric_limits<std::int32_t>::max();
constexpr std::int32_t kMin = std::numeric_limits<std::int32_t>::min();
constexpr int kExponents[] = {std::numeric_limits<int>::min(), -70, -1, 0, 1, 70, std::numeric_limits<int>::max()};

/// Random numbers; every third one is an end of the range.
class Extremes {
public:
    std::int32_t next() {
        switch (engine_() % 6) {
            case 0:
                return kMax;
            case 1:
                return kMin;
            case 2:
                return engine_() % 2 == 0 ? 0 : 1;
            default:
                return static_cast<std::int32_t>(static_cast<std::uint32_t>(engine_())) >> (engine_() % 32);
        }
    }
    std::int64_t wide() { return static_cast<std::int64_t>(std::uint64_t{static_cast<std::uint32_t>(next())} << 32) | next(); }
    int exponent() { return kExponents[engine_() % std::size(kExponents)]; }
    template <typename Matrix>
    Matrix matrix() {
        Matrix m;
        for (Index i = 0; i < m.size(); ++i) {
            m(i) = Matrix::Scalar::from_raw(next());
        }
        return m;
    }

private:
    std::mt19937_64 engine_{51};
};

Wide rounded(Wide value, int bits) { return bits == 0 ? value : (value + (Wide{1} << (bits - 1))) >> bits; }

std::int32_t clamped(Wide value) {
    return static_cast<std::int32_t>(value > kMax ? Wide{kMax} : (value < kMin ? Wide{kMin} : value));
}

template <int A, int B, int Out>
void check_products() {
    Extremes extremes;
    for (int n = 0; n < 100'000; ++n) {
        const auto a = extremes.matrix<Vec3<Fixed<A>>>();
        const auto b = extremes.matrix<Vec3<Fixed<B>>>();
        const auto term = [&](Index i, Index j) { return Wide{a(i).raw()} * b(j).raw(); };
        const Wide sum = term(0, 0) + term(1, 1) + term(2, 2);
        ASSERT_EQ(dot<Out>(a, b).raw(), clamped(rounded(sum, A + B - Out)));
        const auto c = cross<Out>(a, b);
        ASSERT_EQ(c(0).raw(), clamped(rounded(term(1, 2) - term(2, 1), A + B - Out)));
        ASSERT_EQ(c(1).raw(), clamped(rounded(term(2, 0) - term(0, 2), A + B - Out)));
        ASSERT_EQ(c(2).raw(), clamped(rounded(term(0, 1) - term(1, 0), A + B - Out)));
        ASSERT_EQ((product<Out>(a(0), b(0)).raw()), clamped(rounded(term(0, 0), A + B - Out)));
    }
}

TEST(RangeEnd, DotAndCrossProductsAreExactOverTheWholeRange) {
    check_products<30, 30, 30>();
    check_products<28, 30, 28>();
    check_products<28, 28, 27>();
    check_products<31, 28, 28>();
}

TEST(RangeEnd, RatiosAndUnitVectors) {
    Extremes extremes;
    for (int n = 0; n < 100'000; ++n) {
        const std::int64_t numerator = extremes.wide();
        const std::int64_t denominator = extremes.wide() & std::numeric_limits<std::int64_t>::max();
        if (denominator > (1 << 30)) {
            const double exact = static_cast<double>(numerator) / static_cast<double>(denominator);
            ASSERT_NEAR(ratio(numerator, denominator).to_double(), std::clamp(exact, -2.0, 2.0), 1e-8);
        }
        const Vec3<std::int64_t> v(extremes.wide() / 4, extremes.next(), extremes.wide() / 4);
        if (v.cwiseAbs().maxCoeff() > (1 << 26)) {
            ASSERT_LT((to_double(unit_vector(v)) - v.cast<double>().normalized()).norm(), 1e-8);
        }
    }
    EXPECT_EQ(ratio(1, 0), Unit::largest());
    EXPECT_EQ(ratio(-1, 0), Unit::smallest());
    EXPECT_EQ(ratio(0, 0), Unit(0));
    EXPECT_TRUE(unit_vector(Vec3<std::int64_t>::Zero()) == Vec3<Unit>::Zero());
}

/// Rounded towards zero, after both numbers were rounded such that the denominator has at most 31 bits.
TEST(RangeEnd, QuotientsAreThoseOfADivision) {
    Extremes extremes;
    for (int n = 0; n < 20'000; ++n) {
        const std::int64_t denominator = extremes.wide() & std::numeric_limits<std::int64_t>::max();
        const Quotients quotients(denominator);
        for (int k = 0; k < 10; ++k) {
            const std::int64_t numerator = k % 2 == 0 ? extremes.wide() : denominator / (1 + k) - k;
            int bits = 0;
            while ((denominator >> bits) >> 31 != 0) {
                ++bits;
            }
            const Wide divisor = rounded(denominator, bits);
            const Wide dividend = rounded(numerator, bits);
            const Unit expected =
                divisor == 0 ? ratio(numerator, 0) : Unit::from_raw(clamped((dividend * (Wide{1} << 30)) / divisor));
            ASSERT_EQ(quotients.of(numerator), expected) << numerator << " / " << denominator;
        }
    }
}

TEST(RangeEnd, NumbersWithAnExponent) {
    Extremes extremes;
    for (int n = 0; n < 200'000; ++n) {
        const Scaled a = normalise(extremes.next(), extremes.exponent());
        const Scaled b = normalise(extremes.next(), extremes.exponent());
        for (const Scaled s :
             {multiply(a, b), add(a, b), divide(a, b), square_root(a), cube_root(a), normalise(extremes.wide(), 3)}) {
            ASSERT_TRUE(s.mantissa == 0 || std::abs(std::int64_t{s.mantissa}) >= 1 << 29);
        }
        ASSERT_FALSE(is_less(a, a));
        const std::int64_t raw = to_fixed<28>(Scaled{a.mantissa, extremes.exponent()}).raw();
        ASSERT_TRUE(raw == 0 || (raw > 0) == (a.mantissa > 0));
    }
    EXPECT_EQ(divide({1 << 30, 0}, {}), (Scaled{kMax, kMaxExponent}));
    EXPECT_EQ(divide({-(1 << 30), 0}, {}), (Scaled{-kMax, kMaxExponent}));
    EXPECT_EQ(divide({}, {}), Scaled{});
}

TEST(RangeEnd, SumsProductsAndRootsOfNumbersWithAnExponent) {
    std::mt19937_64 random(52);
    const auto value_of = [](Scaled s) { return std::ldexp(static_cast<long double>(s.mantissa), s.exponent); };
    for (int n = 0; n < 200'000; ++n) {
        const auto any = [&random] {
            return normalise(static_cast<std::int64_t>(random()), static_cast<int>(random() % 80) - 70);
        };
        const Scaled a = any();
        const Scaled b = any();
        const long double x = value_of(a);
        const long double y = value_of(b);
        ASSERT_LE(std::abs(value_of(multiply(a, b)) - x * y), std::abs(x * y) * 0x1p-30L);
        ASSERT_LE(std::abs(value_of(add(a, b)) - (x + y)), std::max(std::abs(x), std::abs(y)) * 0x1p-29L);
        ASSERT_EQ(is_less(a, b), x < y);
        if (x > 0) {
            ASSERT_LE(std::abs(value_of(square_root(a)) - std::sqrt(x)), std::sqrt(x) * 0x1p-29L);
        }
    }
}

TEST(RangeEnd, BlocksOfAnyExponent) {
    Extremes extremes;
    for (int n = 0; n < 20'000; ++n) {
        BlockMatrix x;
        x.exponent = extremes.exponent();
        for (Index i = 0; i < 9; ++i) {
            x.mantissa(i) = extremes.next();
        }
        const NormalisedBlock block = normalise(x);
        std::int32_t largest = 0;
        for (Index i = 0; i < 9; ++i) {
            largest = std::max(largest, abs(block.y(i)).raw());
        }
        ASSERT_TRUE(block.zero || (largest >= 1 << 27 && largest <= 1 << 28));
        const Scaled c{extremes.next(), extremes.exponent()};
        const auto direct = solve_direct(x, c);
        if (direct.ok()) {
            ASSERT_NEAR(to_double(direct->direction).norm(), 1, 1e-7);
            const auto next = step_vectors(x, c, {direct->range_m, direct->direction, direct->attitude});
            ASSERT_TRUE(!next.ok() || next->range_m.raw() >= 0);
        }
        std::array<BlockColumn, 3> columns;
        for (auto& column : columns) {
            column.exponent = extremes.exponent();
            column.in_phase << extremes.next(), extremes.next(), extremes.next();
        }
        const BlockMatrix assembled = assemble(columns);
        ASSERT_LE(std::abs(assembled.exponent), kMaxExponent);
    }
}

TEST(RangeEnd, WindowsAndReferencesOfAnyLength) {
    std::vector<Sample> samples(2 * kMaxBlockSamples);
    for (auto& sample : samples) {
        sample = {kMax, kMin, 1, kMax};
    }
    for (const int cycles : {kMin, -1, 0, 1, 500, kMax}) {
        for (const int window : {kMin, -1, 0, 1, 200, kMaxBlockSamples, kMax}) {
            const Oscillator oscillator(cycles, window);
            const auto sums = lock_in(oscillator, samples);
            EXPECT_EQ(sums[0].re, lock_in(oscillator, std::span(samples).first(kMaxBlockSamples))[0].re);
            EXPECT_EQ(lock_in(oscillator, {})[0].re, 0);
        }
    }
    std::array<Phasor, kChannels> ends{};
    Extremes extremes;
    for (int n = 0; n < 20'000; ++n) {
        for (Phasor& phasor : ends) {
            phasor = {extremes.wide(), extremes.wide()};
        }
        for (const std::size_t window : {std::size_t{0}, std::size_t{200}, std::numeric_limits<std::size_t>::max()}) {
            const auto column = couplings(ends, window, extremes.next());
            ASSERT_TRUE(column.ok() || column.status().code() == StatusCode::degenerate);
        }
    }
    EXPECT_EQ(couplings({}, 0, kMin).status().code(), StatusCode::degenerate);
    ends.fill({std::int64_t{1} << 50, 0});
    EXPECT_EQ(couplings(ends, kMaxBlockSamples, kMax).status().code(), StatusCode::degenerate);
}

TEST(RangeEnd, PassesOutOfRangeAreRefused) {
    BlockMatrix x;
    x.mantissa.diagonal() << 2000, -1000, -1000;
    for (const int passes : {kMin, 0, kMaxPasses + 1, kMax}) {
        EXPECT_EQ(step_vectors(x, {1 << 30, -30}, {}, passes).status().code(), StatusCode::invalid_argument);
    }
    EXPECT_TRUE(step_vectors(x, {1 << 30, -30}, {}, kMaxPasses).ok());
}

}  // namespace
}  // namespace tricoil::fixed

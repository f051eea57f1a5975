#include "core/fixed/fixed.hpp"

#include <gtest/gtest.h>

#include <random>

#include "core/fixed/matrix.hpp"

namespace tricoil::fixed {
namespace {

__extension__ using Wide = __int128;

/// Random numbers of all magnitudes and both signs, including the ends of the range.
class Raws {
public:
    std::int32_t next() {
        switch (engine_() % 16) {
            case 0:
                return std::numeric_limits<std::int32_t>::max();
            case 1:
                return std::numeric_limits<std::int32_t>::min();
            case 2:
                return 0;
            default:
                return static_cast<std::int32_t>(static_cast<std::uint32_t>(engine_())) >> (engine_() % 32);
        }
    }

private:
    std::mt19937_64 engine_{12};
};

Wide clamp(Wide value) {
    const Wide largest = std::numeric_limits<std::int32_t>::max();
    const Wide smallest = std::numeric_limits<std::int32_t>::min();
    return value > largest ? largest : (value < smallest ? smallest : value);
}

/// floor(a / b) for positive b.
Wide floor_divided(Wide a, Wide b) { return a >= 0 ? a / b : -((-a + b - 1) / b); }

template <int F>
void check_arithmetic() {
    Raws raws;
    for (int n = 0; n < 200'000; ++n) {
        const auto a = Fixed<F>::from_raw(raws.next());
        const auto b = Fixed<F>::from_raw(raws.next());
        ASSERT_EQ((a + b).raw(), clamp(Wide{a.raw()} + b.raw()));
        ASSERT_EQ((a - b).raw(), clamp(Wide{a.raw()} - b.raw()));
        ASSERT_EQ((-a).raw(), clamp(-Wide{a.raw()}));
        const Wide one = Wide{1} << F;
        ASSERT_EQ((a * b).raw(), clamp(floor_divided(2 * Wide{a.raw()} * b.raw() + one, 2 * one))) << a.raw() << ' ' << b.raw();
    }
}

TEST(Fixed, IsExactlyRoundedAndSaturatesOverTheWholeRange) {
    check_arithmetic<0>();
    check_arithmetic<16>();
    check_arithmetic<28>();
    check_arithmetic<30>();
    check_arithmetic<31>();
}

TEST(Fixed, ConvertsBetweenFormats) {
    EXPECT_EQ(Fixed<30>::from(Fixed<28>(3)), Fixed<30>::largest());
    EXPECT_EQ(Fixed<30>::from(Fixed<28>(1)), Fixed<30>(1));
    EXPECT_EQ(Fixed<0>::from(Fixed<28>::from(2.5)).raw(), 3);
    EXPECT_EQ(Fixed<28>(9), Fixed<28>::largest());
    EXPECT_EQ(Fixed<28>::from(1e9), Fixed<28>::largest());
    EXPECT_EQ(Fixed<28>::from(-1e9), Fixed<28>::smallest());
    EXPECT_EQ(Fixed<28>::from(std::numeric_limits<double>::quiet_NaN()), Fixed<28>(0));
    EXPECT_EQ(Fixed<28>::from(-0.75).to_double(), -0.75);
}

TEST(Fixed, ServesInMatrices) {
    using Q = Fixed<20>;
    Mat3<Q> m = Mat3<Q>::Identity();
    m(0, 1) = Q::from(0.5);
    const Vec3<Q> v(1, 2, 3);
    const Vec3<Q> expected(2, 2, 3);
    EXPECT_TRUE(Vec3<Q>(m * v) == expected);
    EXPECT_TRUE(multiply<20>(m, v) == expected);
    EXPECT_TRUE(v.cross(Vec3<Q>(0, 0, 1)) == cross<20>(v, Vec3<Q>(0, 0, 1)));
    EXPECT_TRUE(v.dot(v) == Q(14));
}

}  // namespace
}  // namespace tricoil::fixed

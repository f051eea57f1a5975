#include <gtest/gtest.h>

#include "core/base/flag_set.hpp"
#include "core/base/static_vector.hpp"
#include "core/base/status.hpp"
#include "core/base/time.hpp"

namespace tricoil {
namespace {

enum class Colour : std::uint8_t { red, green, blue };

TEST(FlagSet, HoldsExactlyTheFlagsSet) {
    FlagSet<Colour> flags;
    EXPECT_TRUE(flags.empty());
    flags.set(Colour::blue);
    flags.set_if(false, Colour::red);
    EXPECT_TRUE(flags.has(Colour::blue));
    EXPECT_FALSE(flags.has(Colour::red));
    EXPECT_TRUE(flags.has_any({Colour::blue, Colour::red}));
    EXPECT_FALSE(flags.has_any({Colour::green, Colour::red}));
    EXPECT_EQ(flags.bits(), 4U);
}

TEST(StaticVector, RefusesTheElementBeyondItsCapacity) {
    StaticVector<int, 2> v;
    EXPECT_TRUE(v.push_back(1));
    EXPECT_TRUE(v.push_back(2));
    EXPECT_FALSE(v.push_back(3));
    ASSERT_EQ(v.size(), 2U);
    EXPECT_EQ(v[1], 2);
}

TEST(Result, HoldsAValueOrAStatus) {
    const Result<int> good(7);
    const Result<int> bad(Status{StatusCode::timed_out, "no answer"});
    EXPECT_TRUE(good.ok());
    EXPECT_EQ(*good, 7);
    EXPECT_FALSE(bad.ok());
    EXPECT_EQ(bad.status().code(), StatusCode::timed_out);
}

TEST(Result, ItsValueCanBeChanged) {
    StaticVector<int, 2> numbers;
    EXPECT_TRUE(numbers.push_back(7));
    Result<StaticVector<int, 2>> result(numbers);
    for (int& number : *result) {
        ++number;
    }
    EXPECT_EQ((*result)[0], 8);
}

TEST(DeviceTime, RoundsToTheNearestMicrosecondBeyond32Bits) {
    EXPECT_EQ(microseconds_from_seconds(1.0 / 720).count(), 1389);
    EXPECT_EQ(microseconds_from_seconds(-1.0 / 720).count(), -1389);
    const DeviceTime before = device_time_us((std::int64_t{1} << 32) - 1);
    EXPECT_EQ(to_us(before + Microseconds{2}), (std::int64_t{1} << 32) + 1);
}

}  // namespace
}  // namespace tricoil

// TimeBase: the number of instants after which a device clock counts as restarted.
#include "core/tracking/front/time_base.hpp"

#include <gtest/gtest.h>

namespace tricoil::tracking {
namespace {

constexpr Microseconds kStep{1389};

/// TimeBase after a regular sequence of times up to `time`.
TimeBase started_at(DeviceTime time) {
    TimeBase base(Microseconds{10'000}, Microseconds{100'000});
    for (int n = 0; n < 20; ++n) {
        EXPECT_EQ(base.take(n % 3, time - (19 - n) * kStep), TimeBase::Verdict::in_order);
    }
    return base;
}

TEST(TimeBase, RestartsAtTheEighthOldInstantInARow) {
    TimeBase base = started_at(device_time_us(10'000'000));
    for (int n = 0; n < 7; ++n) {
        EXPECT_EQ(base.take(n % 3, device_time_us(5'000) + n * kStep), TimeBase::Verdict::time_backwards) << n;
    }
    EXPECT_EQ(base.take(1, device_time_us(5'000) + 7 * kStep), TimeBase::Verdict::restarted);
}

/// A frame of three simultaneous columns is one instant.
TEST(TimeBase, CountsInstantsAndNotColumns) {
    TimeBase base = started_at(device_time_us(10'000'000));
    for (int n = 0; n < 7 * 3; ++n) {
        EXPECT_EQ(base.take(n % 3, device_time_us(5'000) + n / 3 * kStep), TimeBase::Verdict::time_backwards) << n;
    }
    EXPECT_EQ(base.take(0, device_time_us(5'000) + 7 * kStep), TimeBase::Verdict::restarted);
}

TEST(TimeBase, GoodStampBetweenOldOnesRestartsTheCount) {
    TimeBase base = started_at(device_time_us(10'000'000));
    for (int n = 0; n < 7; ++n) {
        (void)base.take(n % 3, device_time_us(5'000) + n * kStep);
    }
    EXPECT_EQ(base.take(0, device_time_us(10'000'000) + kStep), TimeBase::Verdict::in_order);
    EXPECT_EQ(base.take(1, device_time_us(5'000) + 7 * kStep), TimeBase::Verdict::time_backwards);
}

}  // namespace
}  // namespace tricoil::tracking

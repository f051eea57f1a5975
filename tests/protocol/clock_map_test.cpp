#include "core/protocol/clock_map.hpp"

#include <gtest/gtest.h>

#include <random>

namespace tricoil::protocol {
namespace {

TEST(ClockMap, FindsDriftAndOffsetThroughJitterAndKeepsItsBound) {
    for (const double drift : {0.0, 50e-6, -100e-6}) {
        std::mt19937_64 random(4);
        std::exponential_distribution<> jitter(1 / 200.0);
        ClockMap map;
        double worst = 0;
        const auto true_host = [&](std::int64_t device) {
            return 5'000'000'000 + device + std::llround(drift * static_cast<double>(device));
        };
        for (std::int64_t device = 0; device < 60'000'000; device += 1389) {
            map.observe(device_time_us(device), host_time_us(true_host(device) + std::llround(jitter(random))));
            if (device > 10'000'000) {
                const auto error = static_cast<double>(std::abs(to_us(map.to_host(device_time_us(device))) - true_host(device)));
                worst = std::max(worst, error);
                EXPECT_LE(error, 2 * map.error_bound_us() + 5);
            }
        }
        EXPECT_LT(worst, 20) << "with 200 us mean jitter";
        EXPECT_NEAR(map.drift(), drift, 3e-6);
    }
}

/// A busy host: for seconds every message is late, so the least delay of an interval is long.
TEST(ClockMap, PutsNoMessageAfterItsArrival) {
    std::mt19937_64 random(7);
    std::exponential_distribution<> jitter(1 / 200.0);
    std::uniform_real_distribution<> busy_delay(0, 30'000);
    ClockMap map;
    std::int64_t earliest = 1'000'000;
    for (std::int64_t device = 0; device < 60'000'000; device += 4167) {
        const bool busy = device / 3'000'000 % 3 == 1;
        const HostTime host = host_time_us(5'000'000'000 + device + std::llround(busy ? busy_delay(random) : jitter(random)));
        map.observe(device_time_us(device), host);
        earliest = std::min(earliest, (host - map.to_host(device_time_us(device))).count());
    }
    EXPECT_GE(earliest, -1) << "us; the map rounds to whole microseconds";
}

TEST(ClockMap, RestartsWithTheDevice) {
    ClockMap map;
    EXPECT_FALSE(map.ready());
    map.observe(device_time_us(9'000'000'000), host_time_us(1'000'000));
    map.observe(device_time_us(5), host_time_us(2'000'000));
    ASSERT_TRUE(map.ready());
    EXPECT_EQ(to_us(map.to_host(device_time_us(5))), 2'000'000);
}

TEST(ClockMap, RestartsAfterAPauseOfTheDevice) {
    ClockMap map;
    map.observe(device_time_us(0), host_time_us(1'000'000));
    map.observe(device_time_us(1000), host_time_us(9'000'000));
    EXPECT_EQ(to_us(map.to_host(device_time_us(1000))), 9'000'000);
}

/// Poses of several sensors are not in the order of their times.
TEST(ClockMap, TakesSlightlyOlderTimes) {
    ClockMap map;
    map.observe(device_time_us(10'000), host_time_us(1'010'000));
    map.observe(device_time_us(9'000), host_time_us(1'010'000));
    EXPECT_EQ(to_us(map.to_host(device_time_us(10'000))), 1'010'000);
}

TEST(ClockMapDeathTest, HasNoTimeBeforeTheFirstMessage) {
    EXPECT_DEATH((void)ClockMap{}.to_host(device_time_us(0)), "clock_map.hpp:[0-9]+: assertion failed: ready\\(\\)");
}

}  // namespace
}  // namespace tricoil::protocol

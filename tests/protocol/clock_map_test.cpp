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
            map.observe(device, true_host(device) + std::llround(jitter(random)));
            if (device > 10'000'000) {
                const auto error = static_cast<double>(std::abs(map.to_host_us(device) - true_host(device)));
                worst = std::max(worst, error);
                EXPECT_LE(error, 2 * map.error_bound_us() + 5);
            }
        }
        EXPECT_LT(worst, 20) << "with 200 us mean jitter";
        EXPECT_NEAR(map.drift(), drift, 3e-6);
        EXPECT_NEAR(static_cast<double>(map.to_device_us(map.to_host_us(59'000'000))), 59e6, 1);
    }
}

TEST(ClockMap, RestartsWithTheDevice) {
    ClockMap map;
    EXPECT_FALSE(map.ready());
    map.observe(9'000'000'000, 1'000'000);
    map.observe(5, 2'000'000);
    ASSERT_TRUE(map.ready());
    EXPECT_EQ(map.to_host_us(5), 2'000'000);
}

}  // namespace
}  // namespace tricoil::protocol

// Ten simulated minutes at 960 FDM frames/s on the kernel's CAN: nothing lost, no heap use in the loop.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdio>

#include "board/linux/device_loop.hpp"
#include "drivers/socketcan/can_port.hpp"
#include "tests/alloc/allocation_trap.hpp"
#include "tests/device/program.hpp"

namespace tricoil {
namespace {

TEST(Sustained, LosesNothingAndTouchesNoHeap) {
    const char* const seconds = std::getenv("TRICOIL_SUSTAINED_S");
    const double duration_s = seconds == nullptr ? 600 : std::atof(seconds);
    test::Program peer(fmt::format("{} --link can:vcan0 --mux fdm --rate-hz 960 --duration {} --report /run/report.json",
                                   TRICOIL_FRONT_END, duration_s));
    drivers::CanPort port({"vcan0", 0, drivers::CanSide::host});
    std::uint64_t poses = 0;
    tracking::TrackerTap<double> no_tap;
    linux_board::DeviceLoop loop(port, {}, {}, no_tap, [&](const tracking::PoseEstimate<double>&) { ++poses; });
    while (loop.session().phase() != linux_board::Phase::running) {
        loop.step();
    }
    const auto wanted = static_cast<std::uint64_t>(960 * duration_s) - 2;
    const test::AllocationTrap trap;
    int idle = 0;
    for (std::uint64_t before = 0; poses < wanted && idle < 1000; before = poses) {
        loop.step();
        idle = poses == before ? idle + 1 : 0;
    }
    const std::size_t allocations = trap.count();
    const auto& c = loop.session().counters();
    std::printf(
        "sustained: %.0f s, %llu poses, %llu columns, lost %llu, dropped by the kernel %llu, allocations %zu; latency median "
        "%.0f us, "
        "99 %% %.0f us, max %lld us\n",
        duration_s, static_cast<unsigned long long>(poses), static_cast<unsigned long long>(c.columns),
        static_cast<unsigned long long>(c.lost_columns), static_cast<unsigned long long>(port.counters().receive_dropped),
        allocations, loop.latency().quantile_us(0.5), loop.latency().quantile_us(0.99),
        static_cast<long long>(loop.latency().max_us()));
    EXPECT_GE(poses, wanted);
    EXPECT_EQ(allocations, 0U);
    EXPECT_EQ(c.lost_columns, 0U);
    EXPECT_EQ(port.counters().receive_dropped, 0U);
    EXPECT_EQ(c.starts, 1U);
    EXPECT_EQ(loop.session().refused().total(), 0U);
    const test::AllocationTrap again;
    (void)std::string(100, 'x').size();
    EXPECT_GT(again.count(), 0U) << "the trap must count an allocation";
}

}  // namespace
}  // namespace tricoil

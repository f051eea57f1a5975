// Coil lines on the kernel's simulated GPIO chip; switching order checked in the kernel's trace of GPIO changes.
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <array>
#include <csignal>

#include "drivers/gpiod/gpio_coil_driver.hpp"
#include "drivers/gpiod/gpio_signals.hpp"
#include "drivers/posix/monotonic_clock.hpp"
#include "tests/drivers/gpio_trace.hpp"

namespace tricoil::drivers {
namespace {

const std::array<GpioLineName, 3> kCoils{{{"tracker-sim", "coil_s1"}, {"tracker-sim", "coil_s2"}, {"tracker-sim", "coil_s3"}}};

std::array<bool, 3> levels() { return {test::gpio_level(0), test::gpio_level(1), test::gpio_level(2)}; }

TEST(GpioCoils, AreOffAfterOpenAndFollowEveryState) {
    const test::GpioTrace trace;
    Text reason;
    GpioCoilDriver coils;
    ASSERT_TRUE(coils.open(kCoils, reason).ok()) << reason.c_str();
    EXPECT_THAT(levels(), ::testing::ElementsAre(false, false, false));
    ASSERT_TRUE(coils.excite(Excitation::s2).ok());
    EXPECT_THAT(levels(), ::testing::ElementsAre(false, true, false));
    ASSERT_TRUE(coils.excite(Excitation::all).ok());
    EXPECT_THAT(levels(), ::testing::ElementsAre(true, true, true));
    ASSERT_TRUE(coils.excite(Excitation::s3).ok());
    EXPECT_THAT(levels(), ::testing::ElementsAre(false, false, true));
    coils.switch_off();
    EXPECT_THAT(levels(), ::testing::ElementsAre(false, false, false));
    ASSERT_TRUE(coils.excite(Excitation::s1).ok());
    coils.close();
    EXPECT_EQ(test::lines_on(trace.changes()).at_end, 0) << "switched off by a write, not by the release";
}

TEST(GpioCoils, BreakBeforeMakeInTheKernelsOwnTrace) {
    Text reason;
    GpioCoilDriver coils;
    ASSERT_TRUE(coils.open(kCoils, reason).ok()) << reason.c_str();
    const test::GpioTrace trace;
    constexpr int kFrames = 50;
    for (int frame = 0; frame < kFrames; ++frame) {
        for (const Excitation state : {Excitation::s1, Excitation::s2, Excitation::s3, Excitation::off}) {
            ASSERT_TRUE(coils.excite(state).ok());
        }
        for (const Excitation state : {Excitation::s3, Excitation::s1, Excitation::off}) {
            ASSERT_TRUE(coils.excite(state).ok());
        }
    }
    const auto changes = trace.changes();
    ASSERT_EQ(changes.size(), static_cast<std::size_t>(kFrames) * 10);
    for (std::size_t i = 0; i < changes.size(); ++i) {
        static const std::array<const char*, 10> kExpected{"0+", "0-", "1+", "1-", "2+", "2-", "2+", "2-", "0+", "0-"};
        EXPECT_EQ(changes[i], kExpected[i % kExpected.size()]) << i;
    }
    EXPECT_EQ(test::lines_on(changes).most, 1) << "two coils at once";
}

TEST(GpioCoils, ASecondProgramIsRefused) {
    Text reason;
    GpioCoilDriver first;
    ASSERT_TRUE(first.open(kCoils, reason).ok());
    ASSERT_TRUE(first.excite(Excitation::s2).ok());
    GpioCoilDriver second;
    EXPECT_EQ(second.open(kCoils, reason).code(), StatusCode::device_lost);
    EXPECT_STREQ(reason.c_str(),
                 "GPIO line 'coil_s1' of 'tracker-sim' is in use by 'tricoil'; end that program, or choose another line");
    EXPECT_EQ(second.excite(Excitation::s1).code(), StatusCode::device_lost);
    EXPECT_THAT(levels(), ::testing::ElementsAre(false, true, false));
}

TEST(GpioCoils, MissingChipOrLineIsNamed) {
    Text reason;
    GpioCoilDriver coils;
    auto lines = kCoils;
    lines[1].line = "coil_s9";
    EXPECT_FALSE(coils.open(lines, reason).ok());
    EXPECT_STREQ(reason.c_str(), "GPIO chip 'tracker-sim' has no line 'coil_s9'; see: gpioinfo");
    lines[1].chip = "nowhere";
    EXPECT_FALSE(coils.open(lines, reason).ok());
    EXPECT_THAT(reason.c_str(), ::testing::HasSubstr("GPIO chip 'nowhere': cannot be opened"));
    lines = kCoils;
    lines[2].line = "2";
    EXPECT_TRUE(coils.open(lines, reason).ok())
        << "opened by offset; the failed attempt must have released its lines.  " << reason.c_str();
}

TEST(GpioCoils, ActiveLowLinesAreOffWhenHigh) {
    Text reason;
    GpioCoilDriver coils;
    auto lines = kCoils;
    for (auto& line : lines) {
        line.active_low = true;
    }
    ASSERT_TRUE(coils.open(lines, reason).ok());
    EXPECT_THAT(levels(), ::testing::ElementsAre(true, true, true));
    ASSERT_TRUE(coils.excite(Excitation::s1).ok());
    EXPECT_THAT(levels(), ::testing::ElementsAre(false, true, true));
}

TEST(GpioHeartbeat, ChangesItsLineWithEveryBeatAndEndsLow) {
    Text reason;
    {
        GpioHeartbeat heartbeat;
        ASSERT_TRUE(heartbeat.open({"tracker-sim", "heartbeat"}, reason).ok()) << reason.c_str();
        for (int i = 0; i < 5; ++i) {
            ASSERT_TRUE(heartbeat.beat().ok());
            EXPECT_EQ(test::gpio_level(3), i % 2 == 0);
        }
    }
    EXPECT_FALSE(test::gpio_level(3));
}

TEST(GpioSync, ReportsRisingEdgesWithKernelTime) {
    Text reason;
    test::gpio_drive(4, false);
    GpioSyncLine sync;
    ASSERT_TRUE(sync.open({"tracker-sim", "sync"}, reason).ok()) << reason.c_str();
    HostTime edge;
    EXPECT_EQ(sync.next_edge(edge).code(), StatusCode::not_ready);
    EXPECT_EQ(sync.wait(Microseconds{2000}).code(), StatusCode::timed_out);
    for (int i = 0; i < 5; ++i) {
        const HostTime before = host_now();
        test::gpio_drive(4, true);
        ASSERT_TRUE(sync.wait(Microseconds{500'000}).ok());
        ASSERT_TRUE(sync.next_edge(edge).ok());
        EXPECT_GE(edge, before);
        EXPECT_LE(edge, host_now());
        test::gpio_drive(4, false);
        test::pause_ms(3);
        EXPECT_EQ(sync.next_edge(edge).code(), StatusCode::not_ready) << "a falling edge is not reported";
    }
}

}  // namespace
}  // namespace tricoil::drivers

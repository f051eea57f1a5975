// The tracker never waits. Slow readers lose the oldest poses and get the number of lost poses.
#include "board/host/serve/pose_hub.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace tricoil::host {
namespace {

tracking::PoseEstimate<double> numbered(std::uint32_t sequence) {
    tracking::PoseEstimate<double> pose;
    pose.sequence = sequence;
    pose.time = device_time_us(4167 * std::int64_t{sequence});
    return pose;
}

TEST(PoseHub, ReadersGetPosesSinceTheirLastCall) {
    PoseHub hub;
    hub.pose(numbered(1));
    PoseHub::Cursor cursor = hub.cursor();
    std::vector<ServedPose> poses;
    hub.read(cursor, poses);
    EXPECT_TRUE(poses.empty());
    hub.pose(numbered(2));
    hub.pose(numbered(3));
    hub.read(cursor, poses);
    ASSERT_EQ(poses.size(), 2U);
    EXPECT_EQ(poses[1].pose.sequence, 3U);
    EXPECT_EQ(cursor.missed, 0U);
}

TEST(PoseHub, ASlowReaderMissesTheOldestPoses) {
    PoseHub hub;
    PoseHub::Cursor cursor = hub.cursor();
    for (std::uint32_t n = 0; n < PoseHub::kCapacity + 100; ++n) {
        hub.pose(numbered(n));
    }
    std::vector<ServedPose> poses;
    hub.read(cursor, poses);
    ASSERT_EQ(poses.size(), PoseHub::kCapacity);
    EXPECT_EQ(cursor.missed, 100U);
    EXPECT_EQ(poses.front().pose.sequence, 100U);
}

TEST(PoseHub, KeepsTheNewestForLaterReaders) {
    PoseHub hub;
    EXPECT_TRUE(hub.newest().empty());
    hub.pose(numbered(1));
    hub.pose(numbered(2));
    tracking::PoseEstimate<double> second = numbered(3);
    second.sensor = 1;
    hub.pose(second);
    const auto poses = hub.newest();
    ASSERT_EQ(poses.size(), 2U);
    EXPECT_EQ(poses[0].pose.sequence, 2U);
    EXPECT_EQ(poses[1].pose.sequence, 3U);
    EXPECT_TRUE(poses[0].pose.valid());
    std::this_thread::sleep_for(std::chrono::microseconds(SilenceWatch::kLimit.count() + 20'000));
    EXPECT_FALSE(hub.newest()[0].pose.valid());
}

TEST(SilenceWatch, FlagsASilentSensorOnce) {
    constexpr UtcTime kNow = utc_time_us(1'000'000);
    SilenceWatch watch;
    std::vector<ServedPose> poses{{numbered(1), {}}};
    watch.check(kNow, poses);
    EXPECT_EQ(poses.size(), 1U);
    poses.clear();
    watch.check(kNow + SilenceWatch::kLimit, poses);
    EXPECT_TRUE(poses.empty());
    watch.check(kNow + SilenceWatch::kLimit + Microseconds{1}, poses);
    ASSERT_EQ(poses.size(), 1U);
    EXPECT_FALSE(poses[0].pose.valid());
    poses.clear();
    watch.check(utc_time_us(9'000'000), poses);
    EXPECT_TRUE(poses.empty());
}

}  // namespace
}  // namespace tricoil::host

// The tracker never waits. Slow readers lose the oldest poses and get the number of lost poses.
#include "board/host/serve/pose_hub.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
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

TEST(PoseHub, ATruePoseBelongsToTheNextPoseOnly) {
    PoseHub hub;
    PoseHub::Cursor cursor = hub.cursor();
    hub.truth(0, numbered(1).time, {{1, 2, 3}, Quat<double>::Identity()});
    hub.pose(numbered(1));
    hub.pose(numbered(2));
    std::vector<ServedPose> poses;
    hub.read(cursor, poses);
    ASSERT_EQ(poses.size(), 2U);
    ASSERT_TRUE(poses[0].truth.has_value());
    EXPECT_EQ(poses[0].truth->position_m.y(), 2);
    EXPECT_FALSE(poses[1].truth.has_value());
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

/// A pose at `time_s` with this 3D deviation.
tracking::PoseEstimate<double> uncertain_by(double deviation_m, double time_s) {
    tracking::PoseEstimate<double> pose;
    pose.time = device_time_us(std::llround(1e6 * time_s));
    pose.covariance.setZero();
    pose.covariance(1, 1) = deviation_m * deviation_m;
    return pose;
}

TEST(ExpectedError, IsTheRmsOfTheStatedDeviationsOfTheLastSecond) {
    ExpectedError expected;
    EXPECT_DOUBLE_EQ(expected.after(uncertain_by(3e-3, 0)), 3e-3);
    EXPECT_DOUBLE_EQ(expected.after(uncertain_by(4e-3, 0.5)), std::sqrt(12.5e-6));
    auto invalid = uncertain_by(1, 0.9);
    invalid.flags.set(tracking::PoseFlag::uncertain);
    EXPECT_DOUBLE_EQ(expected.after(invalid), std::sqrt(12.5e-6)) << "invalid poses do not count";
    EXPECT_NEAR(expected.after(uncertain_by(4e-3, 1.2)), 4e-3, 1e-12) << "the first pose is too old";
    auto other = uncertain_by(9e-3, 1.3);
    other.sensor = 1;
    EXPECT_DOUBLE_EQ(expected.after(other), 9e-3);
    EXPECT_NEAR(expected.after(uncertain_by(1e-3, 0.1)), 1e-3, 1e-12) << "the clock began anew";
    EXPECT_TRUE(std::isnan(expected.after([&] {
        auto late = invalid;
        late.time = device_time_us(9'000'000);
        return late;
    }())));
}

TEST(PoseHub, PosesHaveTheirExpectedError) {
    PoseHub hub;
    PoseHub::Cursor cursor = hub.cursor();
    hub.pose(uncertain_by(3e-3, 0));
    hub.pose(uncertain_by(4e-3, 0.5));
    std::vector<ServedPose> poses;
    hub.read(cursor, poses);
    EXPECT_DOUBLE_EQ(poses.at(1).expected_error_m, std::sqrt(12.5e-6));
    EXPECT_NE(served_pose_line(poses[1]).find("\"expected_error_mm\":3.53553"), std::string::npos);
}

/// The trackers of a recording begin twice before its first pose.
TEST(PoseHub, EpochsCountWhatStartsAgain) {
    PoseHub hub;
    PoseHub::Cursor cursor = hub.cursor();
    const auto begin = [&] { hub.begin({}); };
    begin();
    begin();
    hub.pose(uncertain_by(1e-3, 0));
    hub.pose(uncertain_by(1e-3, 0.1));
    begin();
    hub.pose(uncertain_by(1e-3, 0.2));
    std::vector<ServedPose> poses;
    hub.read(cursor, poses);
    EXPECT_EQ(poses.at(1).epoch, 0);
    EXPECT_EQ(poses.at(2).epoch, 1);
    EXPECT_NE(served_pose_line(poses[2]).find("\"epoch\":1"), std::string::npos);
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

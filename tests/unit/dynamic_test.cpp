// Dynamic verification on streams with known clock offset, coordinate frames, lag and errors.
#include "board/host/dynamic/dynamic_report.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "board/support/errors.hpp"
#include "core/geometry/rotations.hpp"
#include "sim/motion/simple_motions.hpp"
#include "tests/support/temporary_path.hpp"

namespace tricoil::host {
namespace {

struct Known {
    double offset_s = 0.137;
    Quat<double> q_world = geometry::rotation_vector_to_quaternion<double>({0.4, -1.1, 0.7});
    Vec3<double> world_m{0.3, -0.2, 1.1};
    Quat<double> q_mount = geometry::rotation_vector_to_quaternion<double>({-0.6, 0.2, 1.9});
    Vec3<double> mount_m{0.05, 0.12, -0.03};
};

PoseStream reference_of(const sim::Motion& motion, double duration_s) {
    std::vector<TimedPose> poses;
    for (double t = 0; t < duration_s; t += 1.0 / 200) {
        const auto p = motion.at(t);
        poses.push_back({t, p.position_m, p.q_source_sensor});
    }
    return {poses, "reference"};
}

/// Pose stream of a tracker with the given lag and noise.
PoseStream tracker_of(const sim::Motion& motion, const Known& k, double duration_s, double lag_s, double noise_m) {
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal(0, 1);
    std::vector<TimedPose> poses;
    for (double t = 0; t < duration_s - 1; t += 1.0 / 240) {
        const auto p = motion.at(t + k.offset_s - lag_s);
        const Vec3<double> noise(normal(random), normal(random), normal(random));
        poses.push_back({t,
                         k.q_world * (p.position_m + p.q_source_sensor * k.mount_m) + k.world_m + noise_m / std::sqrt(3) * noise,
                         k.q_world * p.q_source_sensor * k.q_mount});
    }
    return {poses, "tracker"};
}

TEST(Dynamic, FindsClockFramesAndMount) {
    const sim::HandMotion motion({0.6, 0, 0}, 4);
    const Known known;
    const auto reference = reference_of(motion, 12);
    const auto tracker = tracker_of(motion, known, 12, 0, 0.2e-3);
    const auto found = align_streams(tracker, reference, std::nullopt);
    EXPECT_NEAR(found.time_offset_s, known.offset_s, 20e-6);
    EXPECT_LT(geometry::angle_between(found.q_world, known.q_world), 1e-3);
    EXPECT_LT(geometry::angle_between(found.q_mount, known.q_mount), 1e-3);
    EXPECT_LT((found.world_m - known.world_m).norm(), 1e-3);
    EXPECT_LT((found.mount_m - known.mount_m).norm(), 1e-3);
    const auto report = dynamic_report(tracker, reference, found);
    EXPECT_NEAR(report.position_m.rms, 0.2e-3, 0.02e-3);
    EXPECT_NEAR(report.at_rest_m, 0.2e-3, 0.03e-3);
    EXPECT_LT(std::abs(report.lag_s), 10e-6);
}

TEST(Dynamic, WithCommonClocksALagIsMeasured) {
    const sim::HandMotion motion({0.6, 0, 0}, 4);
    Known known;
    known.offset_s = 0;
    const auto reference = reference_of(motion, 12);
    const auto tracker = tracker_of(motion, known, 12, 2e-3, 0.1e-3);
    const auto report = dynamic_report(tracker, reference, align_streams(tracker, reference, 0.0));
    EXPECT_NEAR(report.lag_s, 2e-3, 0.1e-3);
    EXPECT_NEAR(report.per_speed_s, 2e-3, 0.3e-3);
    const auto& slow = report.bands[2];
    const auto& fast = report.bands[4];
    ASSERT_GT(slow.poses, 20U);
    ASSERT_GT(fast.poses, 20U);
    EXPECT_LT(slow.position_rms_m, fast.position_rms_m);
}

TEST(Dynamic, MotionWithoutTurningIsRefused) {
    const sim::CircleMotion motion({0.6, 0, 0}, 0.1, 1.0);
    std::vector<TimedPose> poses;
    for (double t = 0; t < 5; t += 0.01) {
        poses.push_back({t, motion.at(t).position_m, Quat<double>::Identity()});
    }
    const PoseStream stream(poses, "stream");
    EXPECT_THROW(align_streams(stream, stream, 0.0), InputError);
    EXPECT_THROW(align_streams(stream, stream, std::nullopt), InputError);
    EXPECT_THROW(align_streams(stream, stream, 100.0), InputError);
}

/// The lag is separated from coordinate frame offsets, which could explain a part of it; with the sensor on the body and away
/// from it.
TEST(Dynamic, LagIsSeparatedFromFrameOffsets) {
    const sim::HandMotion motion({0.6, 0, 0}, 4);
    for (const Vec3<double>& mount_m : {Vec3<double>(0, 0, 0), Vec3<double>(0.2, 0, 0.1)}) {
        Known known;
        known.offset_s = 0;
        known.mount_m = mount_m;
        const auto reference = reference_of(motion, 4);
        const auto tracker = tracker_of(motion, known, 4, 2e-3, 0.1e-3);
        const auto report = dynamic_report(tracker, reference, align_streams(tracker, reference, 0.0));
        EXPECT_NEAR(report.lag_s, 2e-3, 0.02e-3);
        EXPECT_EQ(report.alignment.time_offset_s, 0);
    }
}

/// A rotating body moves a sensor that has an offset from it.
TEST(Dynamic, SpeedIsThatOfTheSensor) {
    const sim::HandMotion hand({0.6, 0, 0}, 4);
    const Known known;
    std::vector<TimedPose> poses;
    for (double t = 0; t < 10; t += 1.0 / 200) {
        poses.push_back({t, {0, 0, 0}, hand.at(t).q_source_sensor});
    }
    const PoseStream reference(poses, "reference");
    StreamAlignment alignment;
    alignment.mount_m = known.mount_m;
    for (double t = 1; t < 9; t += 0.1) {
        const auto place = [&](double at) -> Vec3<double> { return hand.at(at).q_source_sensor * known.mount_m; };
        const auto moving = alignment.applied(reference, t);
        const Vec3<double> velocity = (place(t + 1e-4) - place(t - 1e-4)) / 2e-4;
        const Vec3<double> acceleration = (place(t + 1e-3) - 2 * place(t) + place(t - 1e-3)) / 1e-6;
        EXPECT_LT((moving.velocity_m_s - velocity).norm(), 0.01 + 0.05 * velocity.norm());
        EXPECT_LT((moving.acceleration_m_s2 - acceleration).norm(), 0.3 + 0.15 * acceleration.norm());
    }
}

/// Poses in gaps of the reference are not compared; the report counts them.
TEST(Dynamic, GapsAreSkipped) {
    const sim::HandMotion motion({0.6, 0, 0}, 4);
    Known known;
    known.offset_s = 0;
    std::vector<TimedPose> poses;
    const auto whole = reference_of(motion, 12);
    for (const TimedPose& p : whole.poses()) {
        if (p.time_s < 4 || p.time_s > 6) {
            poses.push_back(p);
        }
    }
    const PoseStream reference(poses, "reference");
    const auto tracker = tracker_of(motion, known, 12, 0, 0.2e-3);
    const auto report = dynamic_report(tracker, reference, align_streams(tracker, reference, std::nullopt));
    EXPECT_NEAR(report.position_m.rms, 0.2e-3, 0.02e-3);
    EXPECT_NEAR(static_cast<double>(report.in_gaps), 480, 10);
    EXPECT_GE(report.in_gaps + report.errors.size() + 2, tracker.poses().size());  // the ends may be outside by a microsecond
}

/// Streams of different motions, and clock offsets beyond the search range, are refused.
TEST(Dynamic, UnrelatedStreamsAreRefused) {
    const auto reference = reference_of(sim::HandMotion({0.6, 0, 0}, 4), 12);
    const sim::HandMotion other({0.6, 0, 0}, 5);
    Known known;
    known.offset_s = 0;
    EXPECT_THROW(align_streams(tracker_of(other, known, 12, 0, 1e-4), reference, std::nullopt), InputError);
    EXPECT_THROW(align_streams(tracker_of(other, known, 12, 0, 1e-4), reference, 0.0), InputError);
    known.offset_s = 3;
    const sim::HandMotion same({0.6, 0, 0}, 4);
    EXPECT_THROW(align_streams(tracker_of(same, known, 8, 0, 1e-4), reference, std::nullopt), InputError);
    EXPECT_NEAR(align_streams(tracker_of(same, known, 8, 0, 1e-4), reference, 3.0).lag_s, 0, 20e-6);
}

class StreamFile : public ::testing::Test {
protected:
    void write(const std::string& text) const { std::ofstream(path_) << text; }

    static std::string lines(int count, int bad, const std::string& replacement) {
        std::string text = "time_s,x_m,y_m,z_m,qw,qx,qy,qz\n";
        for (int n = 0; n < count; ++n) {
            text += n == bad ? replacement : std::to_string(0.01 * n) + ",0,0,1,1,0,0,0\n";
        }
        return text;
    }

    /// The message of the refusal, empty if there was none.
    [[nodiscard]] std::string refusal(const std::string& text) const {
        write(text);
        try {
            (void)PoseStream::read(path_);
        } catch (const std::exception& error) {
            return error.what();
        }
        return {};
    }

    std::string path_ = test::path_in_temp("stream.csv");
};

TEST_F(StreamFile, LengthsHaveTheUnitOfTheHeader) {
    std::string text = lines(30, -1, "");
    text.replace(0, text.find('\n'), "time_s,x_in,y_in,z_in,qw,qx,qy,qz");
    write(text);
    EXPECT_NEAR(PoseStream::read(path_).poses().front().position_m.z(), 0.0254, 1e-15);
}

TEST_F(StreamFile, NamesErrorAndLine) {
    EXPECT_EQ(refusal(lines(30, -1, "")), "");
    EXPECT_NE(refusal(lines(30, 5, "0.05,0,0\n")).find(":7: 3 columns"), std::string::npos);
    EXPECT_NE(refusal(lines(30, 5, "0.05,0,0,nan,1,0,0,0\n")).find(":7"), std::string::npos);
    EXPECT_NE(refusal(lines(30, 5, "0.01,0,0,1,1,0,0,0\n")).find("time does not increase"), std::string::npos);
    EXPECT_NE(refusal(lines(30, 5, "0.05,0,0,1,2,0,0,0\n")).find("quaternion"), std::string::npos);
    EXPECT_NE(refusal(lines(30, 5, "0.05,1e300,0,1,1,0,0,0\n")).find("is its unit right"), std::string::npos);
    EXPECT_NE(refusal(lines(10, -1, "")).find("at least 20"), std::string::npos);
    EXPECT_NE(refusal("a,b\n1,2\n").find("no column x_m"), std::string::npos);
    EXPECT_NE(refusal("time_s,x_m,y_m\n1,2,3\n").find("z_m"), std::string::npos);
}

}  // namespace
}  // namespace tricoil::host

// Removal of the motion error from recorded poses.
#include "core/error_model/path_correction.hpp"

#include <gtest/gtest.h>

#include <array>

#include "sim/motion/simple_motions.hpp"
#include "tests/error_model/corrected_tdm.hpp"
#include "tests/support/approx.hpp"

namespace tricoil::error_model {
namespace {

TEST(PathCorrection, MotionIsTheParabolaThroughThreePosesAtUnevenTimes) {
    const Vec3<double> velocity(0.3, -0.2, 0.1);
    const Vec3<double> acceleration(4, 5, -6);
    const Vec3<double> axis = Vec3<double>(1, 2, -2) / 3;
    const auto at = [&](double t) {
        return PathPose<double>{t, Vec3<double>(0.5, 0.1, 0) + t * velocity + t * t / 2 * acceleration,
                                geometry::rotation_vector_to_quaternion<double>((0.7 * t + 1.5 * t * t) * axis)};
    };
    const auto motion = motion_at(at(-0.002), at(0), at(0.005));
    EXPECT_TRUE(is_approx(motion.velocity_m_s, velocity, 1e-12));
    EXPECT_TRUE(is_approx(motion.acceleration_m_s2, acceleration, 1e-10));
    EXPECT_TRUE(is_approx(motion.angular_rate_rad_s, Vec3<double>(0.7 * axis), 1e-12));
    EXPECT_TRUE(is_approx(motion.angular_acceleration_rad_s2, Vec3<double>(3 * axis), 1e-9));
}

TEST(PathCorrection, RemovesTheSkewOfTdm) {
    const sim::HandMotion motion({0.9, 0, 0}, 5);
    paper::TdmParams params;
    params.duration_s = 3;
    const auto result = paper::corrected_tdm<double>(motion, params);
    EXPECT_GT(result.given_rms_m, 1e-3);
    EXPECT_GT(result.gain(), 50);
    const auto in_float = paper::corrected_tdm<float>(motion, params);
    EXPECT_NEAR(in_float.corrected_rms_m, result.corrected_rms_m, 0.3 * result.corrected_rms_m);
}

TEST(PathCorrection, KeepsTheFirstAndTheLastPose) {
    const Quat<double> turned = geometry::rotation_vector_to_quaternion<double>(Vec3<double>(0, 0, 0.1));
    const std::array<PathPose<double>, 3> poses{
        {{0, {0.5, 0, 0}, turned}, {0.01, {0.5, 0.01, 0}, turned}, {0.02, {0.5, 0.02, 0}, turned}}};
    BudgetParams<double> params;
    params.timing.latency_s = 0.003;  // a sensor at 1 m/s along y moves by 3 mm
    std::array<PathPose<double>, 3> corrected{};
    correct_path<double>(poses, params, corrected);
    EXPECT_EQ(corrected[0].position_m.y(), 0);
    EXPECT_NEAR(corrected[1].position_m.y(), 0.013, 1e-12);
    EXPECT_EQ(corrected[1].time_s, 0.01);
    EXPECT_EQ(corrected[2].position_m.y(), 0.02);
    EXPECT_NEAR(geometry::angle_between(corrected[1].q_source_sensor, turned), 0, 1e-9);
    correct_path<double>({}, params, {});
}

}  // namespace
}  // namespace tricoil::error_model

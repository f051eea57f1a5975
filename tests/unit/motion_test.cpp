#include <gtest/gtest.h>

#include <fstream>
#include <numbers>

#include "board/support/errors.hpp"
#include "board/support/sim_input/trajectory_file.hpp"
#include "core/geometry/rotations.hpp"
#include "sim/motion/recorded_motion.hpp"
#include "sim/motion/simple_motions.hpp"
#include "sim/motion/zero_phase_filter.hpp"
#include "sim/world/pose_track.hpp"
#include "tests/support/approx.hpp"
#include "tests/support/temporary_path.hpp"

namespace tricoil::sim {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(CubicSpline, PassesThroughItsPointsAndHoldsItsEnds) {
    using Spline = CubicSpline<1>;
    const Spline spline({0.0, 0.5, 2.0, 2.5}, {Spline::Point::Constant(1), Spline::Point::Constant(-1),
                                               Spline::Point::Constant(3), Spline::Point::Constant(0)});
    EXPECT_NEAR(spline.at(0.5)(0), -1, 1e-14);
    EXPECT_NEAR(spline.at(2.0)(0), 3, 1e-14);
    EXPECT_NEAR(spline.at(-9)(0), 1, 1e-14);
    EXPECT_NEAR(spline.at(99)(0), 0, 1e-14);
}

TEST(CubicSpline, FollowsASmoothCurve) {
    using Spline = CubicSpline<1>;
    std::vector<double> times;
    Spline::Points points;
    for (int i = 0; i <= 100; ++i) {
        times.push_back(0.01 * i * (1 + 0.001 * i));  // not uniform
        points.push_back(Spline::Point::Constant(std::sin(2 * kPi * times.back())));
    }
    const Spline spline(times, points);
    for (double t = 0.1; t < 0.95; t += 0.0037) {
        EXPECT_NEAR(spline.at(t)(0), std::sin(2 * kPi * t), 1e-6);
    }
}

TEST(ZeroPhaseFilter, KeepsSlowSignalsInPlaceAndRemovesFastOnes) {
    Eigen::MatrixXd samples(400, 2);
    for (int i = 0; i < 400; ++i) {
        samples(i, 0) = std::sin(2 * kPi * 0.5 * i / 100);
        samples(i, 1) = std::sin(2 * kPi * 40 * i / 100.0);
    }
    const Eigen::MatrixXd smooth = zero_phase_low_pass(samples, 0.06);
    EXPECT_LT((smooth.col(0) - samples.col(0)).cwiseAbs().maxCoeff(), 2e-3);
    EXPECT_LT(smooth.col(1).segment(50, 300).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(PivotMotion, KeepsTheTipAtRestAndTiltsAllAxes) {
    PivotParams params;
    params.q_mean = geometry::rotation_vector_to_quaternion<double>(Vec3<double>(1, 2, 3).normalized());
    const PivotMotion motion(params);
    Vec3<double> largest = Vec3<double>::Zero();
    for (double t = 0; t < 20; t += 0.1) {
        const Pose pose = motion.at(t);
        EXPECT_LT((pose.position_m + pose.q_source_sensor * params.tip_m - params.pivot_m).norm(), 1e-12);
        for (int axis = 0; axis < 3; ++axis) {
            const Vec3<double> unit = Vec3<double>::Unit(axis);
            largest(axis) = std::max(largest(axis), std::acos((pose.q_source_sensor * unit).dot(params.q_mean * unit)));
        }
    }
    EXPECT_GT(largest.minCoeff(), 0.5);
}

TEST(PaperMotion, IntegratesTheRatesOfEquation40) {
    PaperRates rates;
    rates.azimuth_amplitude = 10 * kPi;
    rates.elevation_offset = 2;
    const PaperMotion motion(rates);
    constexpr double kStep = 1e-6;
    const auto angles = [&](double t) { return geometry::to_spherical(motion.at(t).position_m); };
    for (const double t : {0.01, 0.04, 0.11}) {
        const double azimuth_rate = (angles(t + kStep).azimuth_rad - angles(t - kStep).azimuth_rad) / (2 * kStep);
        const double elevation_rate = (angles(t + kStep).elevation_rad - angles(t - kStep).elevation_rad) / (2 * kStep);
        const double range_rate = (angles(t + kStep).range_m - angles(t - kStep).range_m) / (2 * kStep);
        EXPECT_NEAR(azimuth_rate, 10 * kPi * std::sin(10 * kPi * t), 1e-4);
        EXPECT_NEAR(elevation_rate, 2, 1e-6);
        EXPECT_NEAR(range_rate, 0.3 + 0.2 * std::sin(10 * kPi * t), 1e-6);
    }
    EXPECT_TRUE(is_approx(motion.at(0).position_m, Vec3<double>(0.5, 0, 0)));
}

TEST(HandMotion, IsSeededSmoothAndOfHandSpeed) {
    const HandMotion motion({0.6, 0, 0}, 1);
    const HandMotion same({0.6, 0, 0}, 1);
    const HandMotion other({0.6, 0, 0}, 2);
    EXPECT_EQ(motion.at(1.2).position_m, same.at(1.2).position_m);
    EXPECT_NE(motion.at(1.2).position_m, other.at(1.2).position_m);
    double fastest = 0;
    for (double t = 0; t < 20; t += 0.01) {
        fastest = std::max(fastest, (motion.at(t + 1e-4).position_m - motion.at(t - 1e-4).position_m).norm() / 2e-4);
        EXPECT_GT(motion.at(t).position_m.norm(), 0.15);
    }
    EXPECT_GT(fastest, 0.7);
    EXPECT_LT(fastest, 3);
}

TEST(PoseTrack, InterpolatesTheMotionBetweenItsKnots) {
    const HandMotion motion({0.6, 0, 0}, 1);
    const double sample_s = 1 / 144e3;
    PoseTrack track(motion, 3.0, sample_s);
    for (int n = -1; n < 700; ++n) {
        const Pose pose = track.at(n);
        const Pose exact = motion.at(3.0 + n * sample_s);
        EXPECT_LT((pose.position_m - exact.position_m).norm(), 1e-10);
        EXPECT_LT(geometry::angle_between(pose.q_source_sensor, exact.q_source_sensor), 1e-10);
    }
}

class TrajectoryFile : public ::testing::Test {
protected:
    std::string write(const std::string& text) {
        const std::string path = test::path_in_temp("trajectory.traj");
        std::ofstream(path, std::ios::binary) << text;
        return path;
    }
    static std::string matrix(double x, const std::string& first_row = "1 0 0") {
        return first_row + " " + std::to_string(x) + "\n0 1 0 0.5\n0 0 1 -2\n0 0 0 1\n\n";
    }
    static std::string path_of(int poses) {
        std::string text;
        for (int i = 0; i < poses; ++i) {
            text += matrix(0.1 * i);
        }
        return text;
    }
    std::string error_message(const std::string& text) {
        try {
            host::read_trajectory(write(text));
        } catch (const host::InputError& error) {
            return error.what();
        }
        return "";
    }
};

TEST_F(TrajectoryFile, ReadsPosesInOrder) {
    const auto poses = host::read_trajectory(write(path_of(10)));
    ASSERT_EQ(poses.size(), 10U);
    EXPECT_TRUE(is_approx(poses[3].position_m, Vec3<double>(0.3, 0.5, -2)));
}

TEST_F(TrajectoryFile, NamesEveryErrorWithItsLine) {
    const auto expect = [&](const std::string& text, const std::string& place, const std::string& what) {
        const std::string said = error_message(text);
        EXPECT_NE(said.find(place), std::string::npos) << said;
        EXPECT_NE(said.find(what), std::string::npos) << said;
        EXPECT_EQ(said.find('\n'), std::string::npos) << said;
    };
    const std::string good = path_of(2);
    expect("", "traj", "is empty");
    expect(good + "1 0 0\n", ":11:", "3 columns; 4 are needed");
    expect(good + "1 0 0 x\n", ":11:", "'x' is not a number");
    expect(good + "1 0 0 nan\n", ":11:", "not finite");
    expect(good + matrix(1, "2 0 0"), ":14:", "not a rotation");
    expect(good + matrix(1, "-1 0 0"), ":14:", "not a rotation");
    expect(good + "1 0 0 1\n0 1 0 0\n\n" + matrix(1, "1 0 0"), ":15:", "not a rotation");
    expect("1 0 0\n0 1 0\n", ":1:", "3 numbers; a row of a 4x4 matrix has 4");
    expect(good + "1 0 0 1\n0 1 0 0\n", ":12:", "was cut off");
    expect("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 2\n", ":4:", "0 0 0 1");
    expect(good, "traj", "2 poses");
    expect(std::string("1 0\0 0 0\n", 9), ":1:", "binary");
    EXPECT_THROW(host::read_trajectory("/no/such/file"), host::InputError);
    EXPECT_THROW(host::read_trajectory("/tmp"), host::InputError);
}

TEST(RecordedMotion, RemovesRepeatsSmoothsAndPositions) {
    std::vector<Pose> recording;
    for (int i = 0; i < 300; ++i) {
        const int shown = i % 7 == 3 ? i - 1 : i;  // every seventh sample repeats the one before
        const double t = 0.01 * shown;
        const Quat<double> q = geometry::rotation_vector_to_quaternion<double>({0, 0, 0.5 * std::sin(2 * t)});
        recording.push_back({Vec3<double>(5 + 0.1 * std::sin(4 * t), 1, 2), i % 2 == 0 ? q : Quat<double>(-q.coeffs())});
    }
    const RecordedMotion motion(recording, {});
    EXPECT_NEAR(motion.duration_s(), 2.99, 1e-9);
    Vec3<double> mean = Vec3<double>::Zero();
    for (int i = 0; i < 300; ++i) {
        mean += motion.at(0.01 * i).position_m / 300;
    }
    EXPECT_LT((mean - Vec3<double>(0.9, 0, 0)).norm(), 1e-9);
    // The smooth path follows the true one, apart from a constant offset.
    const double shift = motion.at(1.5).position_m.x() - 0.1 * std::sin(6.0);
    for (double t = 0.5; t < 2.5; t += 0.013) {
        EXPECT_NEAR(motion.at(t).position_m.x() - shift, 0.1 * std::sin(4 * t), 5e-4);
        const Quat<double> q = geometry::rotation_vector_to_quaternion<double>({0, 0, 0.5 * std::sin(2 * t)});
        EXPECT_LT(geometry::angle_between(motion.at(t).q_source_sensor, q), 1e-3);
    }
    const RecordedMotion fast(recording, {.speed = 2});
    EXPECT_NEAR(fast.duration_s(), 1.495, 1e-9);
    EXPECT_TRUE(is_approx(fast.at(0.5).position_m, motion.at(1.0).position_m));
}

TEST(RecordedMotion, RefusesInvalidMotions) {
    const std::vector<Pose> still(50);
    EXPECT_THROW(RecordedMotion(still, {}), std::invalid_argument);
    std::vector<Pose> moving;
    for (int i = 0; i < 50; ++i) {
        moving.push_back({Vec3<double>(0.01 * i, 0, 0), Quat<double>::Identity()});
    }
    EXPECT_NO_THROW(RecordedMotion(moving, {}));
    EXPECT_THROW(RecordedMotion(moving, {.speed = 0}), std::invalid_argument);
    EXPECT_THROW(RecordedMotion(moving, {.cutoff_hz = 60}), std::invalid_argument);
    EXPECT_THROW(RecordedMotion(moving, {.sample_rate_hz = std::numeric_limits<double>::quiet_NaN()}), std::invalid_argument);
}

}  // namespace
}  // namespace tricoil::sim

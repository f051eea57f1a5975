// Calibration without a stage: free motion, a printed grid; fixture names.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <iostream>
#include <numbers>

#include "board/host/calibration/fit_parameters.hpp"
#include "board/host/calibration/fit_quality.hpp"
#include "board/host/calibration/frame_file.hpp"
#include "board/host/calibration/free_motion_fit.hpp"
#include "board/host/calibration/grid_calibration.hpp"
#include "board/host/calibration/pose_set.hpp"
#include "board/host/calibration/self_calibration.hpp"
#include "board/support/calibration_file.hpp"
#include "board/support/errors.hpp"
#include "core/base/angle_units.hpp"
#include "core/geometry/rotations.hpp"
#include "core/linear/eigen.hpp"
#include "sim/motion/simple_motions.hpp"
#include "tests/support/approx.hpp"
#include "tests/support/random_poses.hpp"
#include "tests/support/triads/data_set.hpp"

namespace tricoil::host {
namespace {

/// Gains within 5 %; each axis turned by 3 degrees in a random direction.
Mat3<double> misaligned_triad(test::RandomPoses& random) {
    Mat3<double> m;
    for (int c = 0; c < 3; ++c) {
        const Vec3<double> turn = 3 / kDegrees * random.direction();
        m.col(c) = random.uniform(0.95, 1.05) * (geometry::rotation_vector_to_quaternion<double>(turn) * Vec3<double>::Unit(c));
    }
    return m;
}

/// Observable part of a triad: lengths of its columns and angles between them, at mean squared length one.
struct Shape {
    Vec3<double> gain;
    Vec3<double> angle_deg;
};
Shape shape_of(Mat3<double> m) {
    m *= std::sqrt(3.0) / m.norm();
    Shape s;
    s.gain = m.colwise().norm();
    for (int c = 0; c < 3; ++c) {
        s.angle_deg(c) = kDegrees * std::acos(m.col(c).normalized().dot(m.col((c + 1) % 3).normalized()));
    }
    return s;
}

/// Frames of a hand motion; column j is measured j * skew frame periods late.
std::vector<CouplingFrame> hand_frames(const Mat3<double>& sensor, const Mat3<double>& source, double seconds, double rate_hz,
                                       double snr, double skew) {
    const sim::HandMotion motion({0.45, 0.1, 0.1}, 5);
    test::RandomPoses random(61);
    std::vector<CouplingFrame> frames;
    for (int k = 0; k < seconds * rate_hz; ++k) {
        Mat3<double> x;
        double strength = 0;
        for (int j = 0; j < 3; ++j) {
            const auto pose = motion.at((k + j * skew) / rate_hz);
            const Mat3<double> ideal = test::unit_signal(pose.position_m, pose.q_source_sensor);
            strength = ideal.norm() / std::sqrt(1.5);
            x.col(j) = (sensor.transpose() * ideal * source).col(j);
        }
        frames.push_back({x + strength / snr * random.gaussian_matrix()});
    }
    return frames;
}

TEST(SelfCalibration, FindsGainsAndAnglesFromAMinuteOfHandMotionAt60Decibels) {
    test::RandomPoses random(60);
    const Mat3<double> sensor = misaligned_triad(random);
    const Mat3<double> source = misaligned_triad(random);
    const auto found = self_calibrate(in_phase_of(deskewed(hand_frames(sensor, source, 60, 60, 1000, 1.0 / 3), 1.0 / 3)));
    double worst_gain = 0;
    double worst_angle = 0;
    for (const auto& [truth, estimate] :
         {std::pair{shape_of(sensor), shape_of(found.sensor)}, {shape_of(source), shape_of(found.source)}}) {
        worst_gain = std::max(worst_gain, (estimate.gain.cwiseQuotient(truth.gain) - Vec3<double>::Ones()).cwiseAbs().maxCoeff());
        worst_angle = std::max(worst_angle, (estimate.angle_deg - truth.angle_deg).cwiseAbs().maxCoeff());
    }
    std::cout << "gains to " << 100 * worst_gain << " %, angles to " << worst_angle << " deg; misfit " << found.misfit_before
              << " before, " << found.misfit_after << " after\n";
    EXPECT_TRUE(found.converged);
    EXPECT_LT(worst_gain, 0.002);
    EXPECT_LT(worst_angle, 0.2);
    EXPECT_LT(found.misfit_after, 0.1 * found.misfit_before);
}

TEST(SelfCalibration, DeskewReducesTheMisfit) {
    const Mat3<double> ideal = Mat3<double>::Identity();
    const auto frames = hand_frames(ideal, ideal, 20, 240, 1e6, 1.0 / 3);
    const auto skewed = self_calibrate(in_phase_of(frames));
    const auto straight = self_calibrate(in_phase_of(deskewed(frames, 1.0 / 3)));
    std::cout << "misfit of skewed columns " << skewed.misfit_after << ", deskewed " << straight.misfit_after << "\n";
    EXPECT_GT(skewed.misfit_after, 1e-3);
    EXPECT_LT(straight.misfit_after, 0.1 * skewed.misfit_after);
}

TEST(SelfCalibration, RefusesDegenerateData) {
    const Mat3<double> x = test::unit_signal({0.4, 0.1, -0.2}, Quat<double>::Identity());
    EXPECT_THROW(self_calibrate(std::vector<Mat3<double>>(10, x)), InputError);
    EXPECT_THROW(self_calibrate(std::vector<Mat3<double>>(500, x)), InputError);  // the sensor does not move
}

TEST(GridCalibration, FindsScaleGainsAndPivotFromAPrintedGrid) {
    test::RandomPoses random(62);
    const Mat3<double> sensor = misaligned_triad(random);
    const Mat3<double> source = 2.5e-3 * misaligned_triad(random);
    const Vec3<double> pivot(0.004, -0.003, 0.012);
    const Quat<double> turned = Quat<double>(0.98, 0.1, -0.1, 0.15).normalized();
    std::vector<GridFrame> frames;
    for (int column = 0; column < 6; ++column) {
        for (int row = 0; row < 5; ++row) {
            for (int turn = 0; turn < 6; ++turn) {
                GridFrame frame;
                frame.node = {double(column), double(row), 0};
                const Quat<double> q = random.attitude();
                const Vec3<double> p =
                    Vec3<double>(0.25, -0.1, -0.1) + turned * (0.05 * frame.node) + q * pivot + 0.0003 * random.gaussian_vector();
                const Mat3<double> ideal = test::unit_signal(p, q);
                frame.x = sensor.transpose() * ideal * source +
                          1e-3 * 2.5e-3 * ideal.norm() / std::sqrt(1.5) * random.gaussian_matrix();
                frames.push_back(frame);
            }
        }
    }
    const auto found = calibrate_on_grid(frames, 0.05, Vec3<double>::UnitX());
    const auto truth = shape_of(source);
    const auto& moment = found.coils.model.source_moment;
    const auto& sensitivity = found.coils.model.sensor_sensitivity;
    const auto shape = shape_of(moment);
    // Only the product of the scales of source and sensor is observable.
    const double scale =
        std::cbrt((moment.determinant() * sensitivity.determinant()) / (source.determinant() * sensor.determinant()));
    std::cout << "C off by " << 100 * (scale - 1) << " % (+- " << 100 * found.scale_deviation << "), pivot "
              << 1e3 * eigen(found.pivot_m.front()).transpose() << " mm, positions " << 1e3 * found.position_rms_m << " mm\n";
    EXPECT_NEAR(scale, 1, 0.005);
    EXPECT_LT((shape.gain - truth.gain).cwiseAbs().maxCoeff(), 0.003);
    EXPECT_LT((shape.angle_deg - truth.angle_deg).cwiseAbs().maxCoeff(), 0.3);
    EXPECT_NEAR(found.pivot_m.front().norm(), pivot.norm(),
                5e-4);  // its direction depends on the rotation of the sensor frame, which is not observable
    EXPECT_LT(found.position_rms_m, 1.5e-3);
    const auto finite = calibrate_on_grid(frames, 0.05, Vec3<double>::UnitX(), FitModel::finite);
    EXPECT_NEAR(finite.coils.model.source_moment.trace() * finite.coils.model.sensor_sensitivity.trace() /
                    (moment.trace() * sensitivity.trace()),
                1, 0.01);
    EXPECT_LT(finite.position_rms_m, 1.5e-3);
    EXPECT_NEAR(finite.pivot_m.front().norm(), pivot.norm(), 1e-3);
    std::vector<GridFrame> one_row;
    std::copy_if(frames.begin(), frames.end(), std::back_inserter(one_row), [](const GridFrame& f) { return f.node.y() == 0; });
    EXPECT_THROW(calibrate_on_grid(one_row, 0.05, Vec3<double>::UnitX()), InputError);
}

/// Coils with positions and sizes, and their couplings in random poses, three quarters of them in front of the source.
struct RealCoils {
    static constexpr double kC = 2.5e-3;
    std::array<double, kMagnetic> parameters{};
    std::vector<solver::RigidPose<double>> poses;
    std::vector<Mat3<double>> frames;

    explicit RealCoils(int count) {
        test::RandomPoses random(64);
        for (int k = 0; k < kMagnetic; ++k) {
            const double spread = k < kSourceOffsets ? 0.05 : k < kOctupoles ? 0.03 : 0.002;
            parameters[k] = random.uniform(-spread, spread);
        }
        for (const int diagonal : {0, 1, 2, kSensitivities, kSensitivities + 1}) {
            parameters[diagonal] += 1;
        }
        parameters[2] = 3 - parameters[0] - parameters[1];
        for (int source = 0; source < 3; ++source) {
            parameters[kOctupoles + source] -= 0.008;
        }
        const auto model = model_of(parameters.data(), kC);
        for (int k = 0; k < count; ++k) {
            Vec3<double> direction = random.direction();
            if (direction.x() < 0 && k % 2 == 0) {
                direction = -direction;
            }
            poses.push_back({random.uniform(0.2, 0.35) * direction, random.attitude()});
            const Mat3<double> x = field::signal_matrix<double>(model, poses.back().position_m,
                                                                poses.back().q_source_sensor.toRotationMatrix().transpose());
            frames.push_back(x + 1e-5 * x.norm() * random.gaussian_matrix());
        }
    }
};

TEST(FreeMotionFit, FindsPositionsAndSizesOfAllCoilsWithinTheirDeviations) {
    const RealCoils real(400);
    const auto found = fit_free_motion(real.frames, FitModel::finite, RealCoils::kC, Vec3<double>::UnitX());
    double worst = 0;
    for (std::size_t k = 0; k < found.coils.parameters.size(); ++k) {
        const FittedParameter& p = found.coils.parameters[k];
        const double error = std::abs(p.value - unit_of(k) * real.parameters[k]);
        worst = std::max(worst, error / (p.deviation + 1e-6 * unit_of(k)));
        EXPECT_LT(error, p.deviation + 1e-5 * unit_of(k)) << p.name << " " << p.value << " +- " << p.deviation;
    }
    double squares = 0;
    for (std::size_t k = 0; k < real.poses.size(); ++k) {
        squares += (found.poses[k].position_m - real.poses[k].position_m).squaredNorm();
    }
    std::cout << "worst parameter " << worst << " deviations; positions "
              << 1e3 * std::sqrt(squares / static_cast<double>(real.poses.size())) << " mm RMS, stated "
              << 100 * found.position_error_share << " % of the range\n";
    EXPECT_EQ(found.coils.parameters.size(), static_cast<std::size_t>(kMagnetic));
    EXPECT_TRUE(found.coils.warnings.empty()) << found.coils.warnings.front();
    EXPECT_LT(std::sqrt(squares / static_cast<double>(real.poses.size())), 5e-5);
}

TEST(FreeMotionFit, WarnsOfMotionThatTurnsAboutOneAxis) {
    RealCoils real(300);
    const auto model = model_of(real.parameters.data(), RealCoils::kC);
    test::RandomPoses random(65);
    for (std::size_t k = 0; k < real.frames.size(); ++k) {
        const Mat3<double> o =
            geometry::rotation_vector_to_quaternion<double>((random.uniform(-2, 2)) * Vec3<double>::UnitZ()).toRotationMatrix();
        const Vec3<double> place = Vec3<double>(0.25, 0, 0) + 0.05 * random.uniform(0, 1) * random.direction();
        const Mat3<double> x = field::signal_matrix<double>(model, place, o);
        real.frames[k] = x + 1e-3 * x.norm() * random.gaussian_matrix();
    }
    const auto found = fit_free_motion(real.frames, FitModel::finite, RealCoils::kC, Vec3<double>::UnitX());
    ASSERT_FALSE(found.coils.warnings.empty());
    EXPECT_THAT(found.coils.warnings.back(), ::testing::HasSubstr("determine the coils weakly"));
    EXPECT_GT(found.position_error_share, 5e-3);
}

TEST(FreeMotionFit, RefusesFewFramesAndLeftHandedCouplings) {
    RealCoils real(60);
    const std::vector<Mat3<double>> few(real.frames.begin(), real.frames.begin() + 20);
    EXPECT_THROW(fit_free_motion(few, FitModel::finite, 1, Vec3<double>::UnitX()), InputError);
    for (Mat3<double>& x : real.frames) {
        x.row(0) *= -1;
    }
    EXPECT_THROW(fit_free_motion(real.frames, FitModel::finite, 1, Vec3<double>::UnitX()), InputError);
}

TEST(FixtureName, NamesAreRotations) {
    EXPECT_TRUE(rotation_of_fixture("YoutZup")->isIdentity());
    for (const char* name : {"ZinXdown", "ZinYup", "XleftYdown"}) {
        const auto r = rotation_of_fixture(name);
        ASSERT_TRUE(r) << name;
        EXPECT_NEAR(r->determinant(), 1, 1e-12);
    }
    EXPECT_EQ(Vec3<double>(rotation_of_fixture("ZinXdown")->col(2)), Vec3<double>(0, -1, 0));
    EXPECT_EQ(Vec3<double>(rotation_of_fixture("ZinXdown")->col(0)), Vec3<double>(0, 0, -1));
    for (const char* name : {"", "YoutYup", "YoutZin", "somewhere", "YoutZupp"}) {
        EXPECT_FALSE(rotation_of_fixture(name)) << name;
    }
}

}  // namespace
}  // namespace tricoil::host

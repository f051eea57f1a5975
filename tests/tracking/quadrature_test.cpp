// Quadrature of the couplings: metal, but not noise, motion or known phase errors.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <optional>
#include <random>
#include <string>

#include "core/tracking/methods/any_tracker.hpp"
#include "tests/support/column_replay.hpp"
#include "tests/support/hand_like.hpp"

namespace tricoil::tracking {
namespace {

constexpr double kNoise = 1e-8;
constexpr double kLag_s = 7e-5;

struct Seen {
    int poses = 0;
    int distorted = 0;
    double distortion_m = 0;  // of the last pose
    double deviation_m = 0;
};

/// True rates of the couplings (1/s).
Mat3<double> rates(const sim::Motion& motion, double t) {
    constexpr double kStep_s = 1e-4;
    const auto couplings = [&](double at_s) {
        const sim::Pose pose = motion.at(at_s);
        return field::signal_matrix<double>(test::kCoupling, pose.position_m, geometry::attitude_matrix(pose.q_source_sensor));
    };
    return (couplings(t + kStep_s) - couplings(t - kStep_s)) / (2 * kStep_s);
}

struct Signal {
    double floor = 0;
    double quadrature = 0;  // of every coupling, relative to k at 0.5 m
    double lag_s = 0;       // quadrature over the rate of the couplings: 0.8 from the next coil, 0.6 from the coil itself
    bool tdm = false;
    Mat3<double> phase_rad = Mat3<double>::Zero();  // of the columns
    std::optional<calibration::Calibration<double>> calibration = std::nullopt;
};

/// Poses of columns of a motion, 0.3 s after the start.
Seen play(const MethodParams<double>& method, const sim::Motion& motion, const Signal& signal) {
    auto params = test::scaat_params<double>(signal.tdm, motion.at(0).position_m);
    params.method = method;
    params.common.quadrature_floor = signal.floor;
    params.common.quadrature_lag_s = kLag_s;
    AnyTracker tracker(params, signal.calibration);
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal(0, kNoise);
    const double k = field::coupling_strength(test::kCoupling, 0.5);
    Seen seen;
    test::replay<double>(motion, {signal.tdm, kNoise, 3, 0, 2.5}, [&](Column<double> column) {
        const Mat3<double> rate = rates(motion, to_seconds(column.midpoint));
        const int j = coil_index(column.state);
        column.quadrature = Vec3<double>::Constant(signal.quadrature * k) +
                            signal.lag_s * (0.6 * rate.col(j) + 0.8 * rate.col((j + 1) % kSourceCoils));
        column.quadrature += Vec3<double>(normal(random), normal(random), normal(random));
        for (int i = 0; i < kSensorCoils; ++i) {
            const auto turned = std::polar(1.0, signal.phase_rad(i, j)) * std::complex(column.in_phase(i), column.quadrature(i));
            column.in_phase(i) = turned.real();
            column.quadrature(i) = turned.imag();
        }
        const auto pose = tracker.update(column);
        if (pose && to_seconds(pose->time) > 0.3) {
            ++seen.poses;
            seen.distorted += pose->flags.has(PoseFlag::distorted) ? 1 : 0;
            seen.distortion_m = pose->distortion_m;
            seen.deviation_m = std::sqrt(pose->covariance.template topLeftCorner<3, 3>().trace());
        }
    });
    return seen;
}

class Quadrature : public ::testing::TestWithParam<MethodParams<double>> {
protected:
    test::RampMotion rest_{
        {{0.3, 0.4, 0}, Quat<double>(0.9, 0.3, -0.2, 0.1).normalized()}, Vec3<double>::Zero(), Vec3<double>::Zero()};
};

TEST_P(Quadrature, OfNoiseIsNotMetal) {
    for (const bool tdm : {false, true}) {
        const Seen seen = play(GetParam(), rest_, {.tdm = tdm});
        EXPECT_GT(seen.poses, 400);
        EXPECT_EQ(seen.distorted, 0) << tdm;
        EXPECT_EQ(seen.distortion_m, 0) << tdm;
    }
}

/// 1e-4 of k is a position error of 0.1 mm; the covariance takes the in-phase effect as 2.5 times as large, the figure as 0.75 of
/// it.
TEST_P(Quadrature, IsMetal) {
    for (const bool tdm : {false, true}) {
        const Seen seen = play(GetParam(), rest_, {.quadrature = 1e-4, .tdm = tdm});
        EXPECT_EQ(seen.distorted, seen.poses) << tdm;
        EXPECT_NEAR(seen.distortion_m, 0.65 * 2.5 * 2.1256 * 0.5 * 1e-4, 0.1 * seen.distortion_m) << tdm;
        EXPECT_GE(seen.deviation_m, seen.distortion_m) << tdm;
    }
}

TEST_P(Quadrature, WithinThePhaseErrorsIsNotMetal) {
    EXPECT_EQ(play(GetParam(), rest_, {.floor = 1e-3, .quadrature = 1e-4}).distorted, 0);
    const double unknown = CommonParams<double>{}.quadrature_floor;
    EXPECT_EQ(play(GetParam(), rest_, {.floor = unknown, .quadrature = 1e-2}).distorted, 0);
}

/// A calibration has the phase of each coupling, and the quadrature that these phases leave.
TEST_P(Quadrature, IsJudgedAfterTheCalibratedPhases) {
    Signal signal;
    signal.phase_rad = 1e-3 * (Mat3<double>() << 0.1, -4.9, 4.7, 3.5, -0.4, 10.2, -1.8, -7.9, -0.1).finished();
    signal.calibration.emplace();
    signal.calibration->model.source_moment *= test::kCoupling;
    signal.calibration->phase_rad = signal.phase_rad;
    signal.calibration->quadrature_floor = 1e-4;
    const Seen clean = play(GetParam(), rest_, signal);
    EXPECT_GT(clean.poses, 400);
    EXPECT_EQ(clean.distorted, 0);
    signal.quadrature = 1e-3;
    EXPECT_EQ(play(GetParam(), rest_, signal).distorted, clean.poses);
    signal.quadrature = 0;
    signal.calibration->phase_rad.colwise() = signal.phase_rad.rowwise().mean();
    EXPECT_EQ(play(GetParam(), rest_, signal).distorted, clean.poses) << "one phase for each channel is not enough";
    signal.calibration->quadrature_floor = 1;
    EXPECT_EQ(play(GetParam(), rest_, signal).distorted, 0) << "the floor is unknown";
}

/// All rates of the couplings pass through zero where a sensor turns back on a line.
TEST_P(Quadrature, OfMotionIsNotMetal) {
    const sim::Pose centre = rest_.at(0);
    const sim::LineMotion line(centre, Vec3<double>(0.05, 0, 0), 3);
    const auto hand = test::hand_like(4);
    for (const sim::Motion* motion : std::initializer_list<const sim::Motion*>{&line, &hand}) {
        EXPECT_EQ(play(GetParam(), *motion, {.lag_s = kLag_s}).distorted, 0);
        EXPECT_GT(play(GetParam(), *motion, {.lag_s = 10 * kLag_s}).distorted, 50);
    }
}

std::string name_of(const ::testing::TestParamInfo<MethodParams<double>>& method) {
    constexpr std::array kNames{"direct", "previous", "scaat"};
    return kNames[method.index];
}

INSTANTIATE_TEST_SUITE_P(Method, Quadrature,
                         ::testing::Values(MethodParams<double>(DirectParams{}), MethodParams<double>(PreviousParams{}),
                                           MethodParams<double>(ScaatParams<double>{})),
                         name_of);

}  // namespace
}  // namespace tricoil::tracking

// Quadrature of the couplings: metal, but not noise, motion or known phase errors.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
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

/// Poses of FDM columns of a motion, 0.5 s after the start. quadrature: of every coupling, relative to k at 0.5 m. lag_s: the
/// quadrature that motion causes, over the rate of the couplings.
Seen play(const MethodParams<double>& method, double floor, double quadrature, const sim::Motion& motion, double lag_s = 0) {
    auto params = test::scaat_params<double>(false, motion.at(0).position_m);
    params.method = method;
    params.common.quadrature_floor = floor;
    params.common.quadrature_lag_s = kLag_s;
    AnyTracker<double> tracker(params);
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal(0, kNoise);
    const double k = field::coupling_strength(test::kCoupling, 0.5);
    std::array<Vec3<double>, kSourceCoils> last;
    Seen seen;
    test::replay<double>(motion, {false, kNoise, 3, 0, 1.5}, [&](Column<double> column) {
        Vec3<double>& before = last[static_cast<std::size_t>(coil_index(column.state))];
        const Vec3<double> rate = (column.in_phase - before) * (test::kSlotsPerSecond / 3);
        before = column.in_phase;
        column.quadrature = Vec3<double>::Constant(quadrature * k) + lag_s * rate;
        column.quadrature += Vec3<double>(normal(random), normal(random), normal(random));
        const auto pose = tracker.update(column);
        if (pose && to_seconds(pose->time) > 0.5) {
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
    const Seen seen = play(GetParam(), 0, 0, rest_);
    EXPECT_GT(seen.poses, 200);
    EXPECT_EQ(seen.distorted, 0);
    EXPECT_EQ(seen.distortion_m, 0);
}

/// 1e-4 of k is a position error of 0.1 mm; the figure takes the in-phase effect as 2.5 times as large.
TEST_P(Quadrature, IsMetal) {
    const Seen seen = play(GetParam(), 0, 1e-4, rest_);
    EXPECT_EQ(seen.distorted, seen.poses);
    EXPECT_NEAR(seen.distortion_m, 2.5 * 2.1256 * 0.5 * 1e-4, 0.1 * seen.distortion_m);
    EXPECT_GE(seen.deviation_m, seen.distortion_m);
}

TEST_P(Quadrature, WithinThePhaseErrorsIsNotMetal) {
    EXPECT_EQ(play(GetParam(), 1e-3, 1e-4, rest_).distorted, 0);
    EXPECT_EQ(play(GetParam(), CommonParams<double>{}.quadrature_floor, 1e-2, rest_).distorted, 0) << "unknown clean quadrature";
}

TEST_P(Quadrature, OfMotionIsNotMetal) {
    const auto hand = test::hand_like(4);
    EXPECT_EQ(play(GetParam(), 0, 0, hand, kLag_s).distorted, 0);
    EXPECT_GT(play(GetParam(), 0, 0, hand, 10 * kLag_s).distorted, 50);
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

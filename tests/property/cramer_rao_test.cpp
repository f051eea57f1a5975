// The direct solver against the Cramer-Rao bound over the whole workspace.
#include <gtest/gtest.h>

#include "core/solver/direct.hpp"
#include "core/solver/pose_covariance.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::solver {
namespace {

struct Ratios {
    double position;
    double orientation;
};

/// RMSE over RMS bound for poses drawn from 0.15-1.2 m, all directions and attitudes. Errors are normalised by the bound at each
/// pose, so that far poses with large errors do not dominate.
template <typename Scalar>
Ratios rmse_over_bound(double snr_db, int poses, std::uint64_t seed) {
    test::RandomPoses random(seed);
    double position = 0;
    double orientation = 0;
    for (int i = 0; i < poses; ++i) {
        const double range = random.uniform(0.15, 1.2);
        const Vec3<double> u = random.direction();
        const Quat<double> q = random.attitude();
        const double k = field::coupling_strength(1.0, range);
        const double sigma = k * std::pow(10, -snr_db / 20);
        const Mat3<double> x = test::unit_signal(range * u, q) + sigma * random.gaussian_matrix();
        const auto s = solve_direct<Scalar>(x.template cast<Scalar>(), Scalar(1));
        const Vec3<double> found = s->direction.template cast<double>();
        const double sign = found.dot(u) < 0 ? -1 : 1;
        const Mat3<double> o = s->attitude.template cast<double>();
        const Mat6<double> bound = pose_covariance<double>(k, range, u, sigma);
        const double turn = geometry::angle_between(geometry::attitude_quaternion(o), q);
        position +=
            (sign * static_cast<double>(s->range_m) * found - range * u).squaredNorm() / bound.topLeftCorner<3, 3>().trace();
        orientation += turn * turn / bound.bottomRightCorner<3, 3>().trace();
    }
    return {std::sqrt(position / poses), std::sqrt(orientation / poses)};
}

TEST(CramerRao, DirectSolverReachesTheBound) {
    constexpr int kPoses = 20'000;
    constexpr std::uint64_t kSeed = 20260101;
    for (const double snr_db : {40.0, 60.0, 80.0}) {
        const Ratios r = rmse_over_bound<double>(snr_db, kPoses, kSeed);
        std::cout << "SNR " << snr_db << " dB, seed " << kSeed << ": RMSE / bound " << r.position << " (position), "
                  << r.orientation << " (orientation)\n";
        EXPECT_GT(r.position, 0.97);
        EXPECT_LT(r.position, 1.03);
        EXPECT_GT(r.orientation, 0.97);
        EXPECT_LT(r.orientation, 1.03);
        const Ratios single = rmse_over_bound<float>(snr_db, kPoses, kSeed);
        EXPECT_NEAR(single.position, r.position, 1e-3);
        EXPECT_NEAR(single.orientation, r.orientation, 1e-3);
    }
}

}  // namespace
}  // namespace tricoil::solver
